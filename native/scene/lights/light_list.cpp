#include "scene/lights/light_list.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/lights/light_tree.h"
#include "scene/table_rows.h"

namespace edgegrad {
namespace {

float mean(const float* c) { return (c[0] + c[1] + c[2]) / 3.0f; }
// Of the absolute values: lights of the table may be negative.
float mean_size(const float* c) { return (std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2])) / 3.0f; }

// Mean radiance of each material's emission, by which its faces are chosen.
std::vector<float> material_emission(const SceneTables& t) {
    // Textured emission is not zero everywhere, even if its mean is estimated as black.
    constexpr float kLeastTextured = 1e-3f;
    const size_t materials = t.emission.size() / 3;
    std::vector<float> out(materials);
    for (size_t m = 0; m < materials; ++m) {
        out[m] = mean(&t.emission[3 * m]);
        if (has_flags(t, m, kHasEmission)) out[m] = std::max(out[m], kLeastTextured);
    }
    return out;
}

// A Lambertian emitter about an axis.
void set_lambertian(LightNode& n, const float* axis) {
    std::copy_n(axis, 3, n.axis);
    n.cos_o = 1.0f;
    n.sin_o = 0.0f;
    n.cos_e = 0.0f;
}

void set_isotropic(LightNode& n) {
    n.axis[2] = 1.0f;
    n.cos_o = -1.0f;
    n.sin_o = 0.0f;
    n.cos_e = 0.0f;
}

bool triangle_node(const SceneTables& t, size_t face, LightNode& n) {
    const float* p[3];
    for (size_t k = 0; k < 3; ++k) p[k] = &t.vertices[3 * static_cast<size_t>(t.faces[3 * face + k])];
    double a[3], b[3];
    for (int c = 0; c < 3; ++c) {
        a[c] = static_cast<double>(p[1][c]) - p[0][c];
        b[c] = static_cast<double>(p[2][c]) - p[0][c];
    }
    const double m[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const double length = std::hypot(m[0], m[1], m[2]);
    if (!(length > 0.0)) return false;
    float axis[3], radius2 = 0.0f;
    for (int c = 0; c < 3; ++c) {
        axis[c] = static_cast<float>(m[c] / length);
        // The centre of the bounding box is nearer to the corners than the centroid is.
        n.center[c] = 0.5f * (std::min({p[0][c], p[1][c], p[2][c]}) + std::max({p[0][c], p[1][c], p[2][c]}));
    }
    for (const float* q : p) {
        float d = 0.0f;
        for (int c = 0; c < 3; ++c) d += (q[c] - n.center[c]) * (q[c] - n.center[c]);
        radius2 = std::max(radius2, d);
    }
    n.radius = 1.00001f * std::sqrt(radius2);
    set_lambertian(n, axis);
    n.power = static_cast<float>(0.5 * length);  // of unit radiance
    return n.power > 0.0f;
}

// Radius of the scene's bounding box.
double scene_radius(const SceneTables& t) {
    float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    for (size_t k = 0; k < t.vertices.size(); ++k) {
        const float x = t.vertices[k];
        low[k % 3] = k < 3 ? x : std::min(low[k % 3], x);
        high[k % 3] = k < 3 ? x : std::max(high[k % 3], x);
    }
    return 0.5 * std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

// Bound of a row of the light table with the given radiance.
LightNode row_node(const SceneTables::LightRows& lights, size_t k, float radiance) {
    const float* row = &lights.params[kLightParams * k];
    LightNode n{};
    const float* direction = row + kLightDirection;
    std::copy_n(row + kLightPosition, 3, n.center);
    n.power = radiance;
    // Bound suns by their cone
    switch (lights.kind[k]) {
        case kDirectionLight:
        case kConeLight: {
            n.radius = -1.0f;
            std::copy_n(direction, 3, n.axis);
            const float one_minus_cos = row[kLightOneMinusCos];
            n.cos_o = 1.0f - one_minus_cos;
            n.sin_o = std::sqrt(std::max(one_minus_cos * (2.0f - one_minus_cos), 0.0f));
            if (lights.kind[k] == kConeLight)
                n.power *= static_cast<float>(std::numbers::pi) * n.sin_o * n.sin_o;
            return n;
        }
        // Bound area lights by their normal and spread
        case kRectangleLight:
        case kEllipseLight:
            set_lambertian(n, direction);
            n.radius = lights.kind[k] == kRectangleLight ? std::hypot(row[kLightExtentX], row[kLightExtentY])
                                                         : std::max(row[kLightExtentX], row[kLightExtentY]);
            n.power *= row[kLightArea];
            if (lights.flags[k] & kLightSpread) {
                n.cos_e = 1.0f / std::sqrt(1.0f + row[kLightEdge] * row[kLightEdge]) - 1e-4f;
                n.power *= row[kLightEdge] * row[kLightEdgeScale];
            }
            return n;
        // Bound spheres and points by their intensity in all directions
        case kSphereLight:
        case kDiskLight:
            n.radius = row[kLightRadius];
            n.power *= static_cast<float>(std::numbers::pi) * n.radius * n.radius;
            break;
        default:
            break;
    }
    set_isotropic(n);
    if (lights.flags[k] & (kLightCone | kLightLinearCone)) {
        // The intensity within a spot's cone is constant, so all of its directions count as axes.
        const float one_minus_cos = row[kLightOneMinusCos];
        std::copy_n(direction, 3, n.axis);
        n.cos_o = 1.0f - one_minus_cos;
        n.sin_o = std::sqrt(std::max(one_minus_cos * (2.0f - one_minus_cos), 0.0f));
        n.cos_e = 0.9999f;
    }
    return n;
}

// Moves the power of a light whose irradiance falls less than with the square of the distance.
void set_decay(LightNode& n, int32_t flags) {
    if (!(flags & (kLightByWay | kLightByWay2))) return;
    (flags & kLightByWay2 ? n.by_way2 : n.by_way) = n.power;
    n.power = 0.0f;
}

}  // namespace

LightList::LightList(const SceneTables& tables, bool dark_too) {
    add_faces(tables);
    add_rows(tables, dark_too);
    if (dark_too) lift_dark(tables);
    arrange();
    view_.dark_too = dark_too;
}

LightList::LightList(const SceneTables& tables, const std::vector<uint8_t>& rows) {
    add_rows(tables, true, &rows);
    lift_dark(tables);
    arrange();
    view_.dark_too = true;
}

void LightList::add_faces(const SceneTables& t) {
    const std::vector<float> emission = material_emission(t);
    if (std::all_of(emission.begin(), emission.end(), [](float e) { return !(e > 0.0f); })) return;
    // Area lights have faces after those of the visible meshes, for derivatives only. Here they are rows.
    const auto faces = static_cast<size_t>(t.mesh_first_face[static_cast<size_t>(t.visible_meshes)]);
    int32_t mesh = 0;
    for (size_t f = 0; f < faces; ++f) {
        while (static_cast<size_t>(t.mesh_first_face[static_cast<size_t>(mesh) + 1]) <= f) ++mesh;
        const auto material = static_cast<size_t>(t.face_material[f]);
        // What no scattered ray can hit lights nothing
        if (!(emission[material] > 0.0f) || !(t.mesh_mask[static_cast<size_t>(mesh)] & kScatteredRays))
            continue;
        Light light{kTriangleLight, static_cast<int32_t>(f), {}, 0.0, mesh};
        if (!triangle_node(t, f, light.node)) continue;
        view_.any_hidden |= (t.mesh_mask[static_cast<size_t>(mesh)] & kScatteredRays) != kScatteredRays;
        light.area = light.node.power;
        light.node.power *= emission[material];
        light.node.two_sided = t.emission_two_sided[material];
        near_.push_back(light);
    }
    if (!near_.empty()) face_light_.assign(t.face_material.size(), -1);
}

void LightList::add_rows(const SceneTables& t, bool dark_too, const std::vector<uint8_t>* which) {
    const SceneTables::LightRows& lights = t.lights;
    light_of_row_.assign(lights.kind.size(), -1);
    std::vector<int32_t> distant_sized;
    for (size_t k = 0; k < lights.kind.size(); ++k) {
        if (which && !(*which)[k]) continue;
        const float radiance = mean_size(&lights.params[kLightParams * k + kLightRadiance]);
        const bool dark = dark_too && !(radiance > 0.0f);
        Light light{lights.kind[k], static_cast<int32_t>(k), row_node(lights, k, dark ? 1.0f : radiance), 0.0,
                    -1};
        if (!(light.node.power > 0.0f)) continue;
        if (dark)
            light.node.power = 0.0f;
        else
            set_decay(light.node, lights.flags[k]);
        const bool distant = light.node.radius < 0.0f;
        (distant ? distant_ : near_).push_back(light);
        if (!(kPointlikeLights >> light.kind & 1)) (distant ? distant_sized : sized_).push_back(light.index);
        view_.any_hidden |= (lights.visible_to[k] & kScatteredRays) != kScatteredRays;
        view_.any_by_way |= light.node.by_way > 0.0f || light.node.by_way2 > 0.0f;
        view_.any_bounded |= lights.max_bounces[k] < kAnyBounces;
        view_.any_linked |=
            lights.receivers[k] >= 0 || lights.blockers[k] >= 0 || !(lights.flags[k] & kLightCastsShadow);
    }
    view_.sized_count = static_cast<int32_t>(sized_.size());
    view_.sized_distant = static_cast<int32_t>(distant_sized.size());
    sized_.insert(sized_.end(), distant_sized.begin(), distant_sized.end());
    view_.params = rows_of(lights.params);
    view_.flags = rows_of(lights.flags);
    view_.visible_to = rows_of(lights.visible_to);
    view_.receivers = rows_of(lights.receivers);
    view_.blockers = rows_of(lights.blockers);
    view_.max_bounces = rows_of(lights.max_bounces);
    view_.sized = rows_of(sized_);
}

// Raises the power of dark and dim lights, as if all lights of their kind shared a fraction kDim of the total
// power. A larger kDim lowers the noise of their derivatives and raises that of all others. Near lights are
// compared by intensity and distant ones by irradiance; the size of the scene relates the two, and lights of
// different decays.
void LightList::lift_dark(const SceneTables& t) {
    constexpr double kDim = 0.1;
    const double radius = std::max(scene_radius(t), 1e-15);
    const auto power = [&](const std::vector<Light>& lights) {
        double sum = 0.0;
        for (const Light& light : lights)
            sum += static_cast<double>(light.node.intensity(static_cast<float>(radius)));
        return sum;
    };
    double near = power(near_), distant = power(distant_);
    if (near == 0.0 && distant == 0.0) near = 1.0;
    if (near == 0.0) near = distant * radius * radius;
    if (distant == 0.0) distant = near / (radius * radius);
    const auto lift = [&](std::vector<Light>& lights, double all) {
        double area = 0.0, rows = 0.0;
        for (const Light& light : lights) area += light.area, rows += light.area > 0.0 ? 0.0 : 1.0;
        for (Light& light : lights) {
            const double share = light.area > 0.0 ? light.area / area : 1.0 / rows;
            LightNode& n = light.node;
            const float other = n.intensity(static_cast<float>(radius)) - n.power;
            n.power = std::max(n.power, static_cast<float>(kDim * all * share) - other);
        }
    };
    lift(near_, near);
    lift(distant_, distant);
}

void LightList::arrange() {
    std::vector<Light> all = distant_;
    all.insert(all.end(), near_.begin(), near_.end());
    for (size_t k = 0; k < all.size(); ++k) {
        all[k].node.child = -1 - static_cast<int32_t>(k);
        all[k].node.parent = -1;
        kind_.push_back(all[k].kind);
        index_.push_back(all[k].index);
        view_.kinds |= 1 << all[k].kind;
        (all[k].kind == kTriangleLight ? face_light_ : light_of_row_)[static_cast<size_t>(all[k].index)] =
            static_cast<int32_t>(k);
    }
    view_.any_group = near_.size() > kMostFlatLights;
    const size_t single = view_.any_group ? distant_.size() : all.size();
    for (size_t k = 0; k < single; ++k) nodes_.push_back(all[k].node), top_mesh_.push_back(all[k].mesh);
    if (view_.any_group) {
        const int32_t mesh = near_.front().mesh;
        const bool alone =
            std::all_of(near_.begin(), near_.end(), [&](const Light& l) { return l.mesh == mesh; });
        top_mesh_.push_back(alone ? mesh : -1);
        std::vector<LightNode> lights;
        for (size_t k = single; k < all.size(); ++k) lights.push_back(all[k].node);
        const std::vector<LightNode> tree = light_tree(std::move(lights), static_cast<int32_t>(single));
        nodes_.insert(nodes_.end(), tree.begin(), tree.end());
    }
    node_of_.resize(all.size());
    for (size_t k = 0; k < nodes_.size(); ++k)
        if (nodes_[k].child < 0)
            node_of_[static_cast<size_t>(-1 - nodes_[k].child)] = static_cast<int32_t>(k);
    near_ = {};
    distant_ = {};
    view_.count = static_cast<int32_t>(kind_.size());
    view_.top = static_cast<int32_t>(single) + (view_.any_group ? 1 : 0);
    view_.kind = rows_of(kind_);
    view_.index = rows_of(index_);
    view_.node_of = rows_of(node_of_);
    view_.face_light = face_light_.empty() ? nullptr : face_light_.data();
    view_.light_of_row = rows_of(light_of_row_);
    view_.nodes = rows_of(nodes_);
}

}  // namespace edgegrad
