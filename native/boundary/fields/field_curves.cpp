#include "boundary/fields/field_curves.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "boundary/curves/edge_cache.h"
#include "boundary/fields/field_viewer.h"
#include "sdf/outline.h"
#include "tasks/seed_tags.h"
#include "util/double_vector.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Points of the lens from which outlines are searched for. More points blur them more evenly.
constexpr int kLensPoints = 64;

// A field with its carrier, and the face that stands for it.
struct CarriedField {
    FieldView view;
    const FieldCarrier& carrier;
    uint32_t face;
};

template <typename Visit>
void for_each_field(const SceneView& scene, const EdgeList& edges, const std::vector<int32_t>& meshes,
                    const Visit& visit) {
    const SceneTables& t = edges.tables;
    const auto carriers = field_carriers(t, edges.kept, edges.threads);
    for (const int32_t mesh : meshes) {
        const auto k = static_cast<size_t>(mesh - t.first_field());
        visit(CarriedField{scene.fields[k], (*carriers)[k],
                           static_cast<uint32_t>(t.mesh_first_face[static_cast<size_t>(mesh)])});
    }
}

// What distinguishes outlines and patches of fields: their meshes, and whether light travels inside.
std::vector<int32_t> field_key(const SceneView& scene, const EdgeList& edges,
                               const std::vector<int32_t>& meshes) {
    std::vector<int32_t> out;
    for (const int32_t mesh : meshes)
        out.push_back(2 * mesh + (scene.fields[mesh - edges.tables.first_field()].inside ? 1 : 0));
    return out;
}

// Appends the outline of a field, with the second surface of its lines.
void add_outline(const CarriedField& field, const FieldViewer& viewer, LineSurface other, int threads,
                 Intersections& out) {
    const std::vector<float> ends = field_outline(field.view, field.carrier, viewer, threads);
    out.ends.insert(out.ends.end(), ends.begin(), ends.end());
    for (size_t k = 0; k < ends.size() / 6; ++k)
        out.faces.insert(out.faces.end(), {field.face, other.bits()});
    out.instances.insert(out.instances.end(), ends.size() / 3, -1);
}

// A light or a group of lights with a size, as the top of the light tree bounds it.
struct LightBound {
    bool distant;
    Vector center;  // distant: the direction to it
    double radius;  // distant: the sine of the cone
    const LightNode& node;

    // Bound of the irradiance at the square of the distance.
    double irradiance(double square) const {
        if (distant) return std::max(static_cast<double>(node.power), 1e-30);
        const auto all = static_cast<double>(node.intensity(static_cast<float>(std::sqrt(square))));
        return std::max(all, 1e-30) / std::max(square, 1e-30);
    }
};

LightBound bound_of(const LightNode& n) {
    const bool distant = n.radius < 0.0f;
    const float* at = distant ? n.axis : n.center;
    const double sign = distant ? -1.0 : 1.0;
    const float radius = !distant ? n.radius : n.cos_o < 0.0f ? 1.0f : n.sin_o;
    return {distant, {sign * at[0], sign * at[1], sign * at[2]}, static_cast<double>(radius), n};
}

std::vector<LightBound> sized_lights(const LightView& lights) {
    std::vector<LightBound> out;
    for (int32_t k = 0; k < lights.top; ++k) {
        const LightNode& n = lights.nodes[k];
        if (n.child >= 0 || is_sized(lights.kind[-1 - n.child])) out.push_back(bound_of(n));
    }
    return out;
}

// The middle of a triangle of a carrier on the field's surface, in the world.
struct PatchMiddle {
    Vector point, normal;
    double area, radius;
    double bend[6];  // H / |g|
    double largest;  // the largest normal curvature that counts
    bool inside;     // light travels inside, so that negative ones count, too
    double spread;   // bound of the angles between the patch's normals and that of the middle

    double curvature(Vector w) const {
        return bend[0] * w.x * w.x + bend[1] * w.y * w.y + bend[2] * w.z * w.z +
               2.0 * (bend[3] * w.y * w.z + bend[4] * w.x * w.z + bend[5] * w.x * w.y);
    }
    double counted_curvature(Vector w) const { return inside ? std::abs(curvature(w)) : curvature(w); }
};

class PatchShape {
 public:
    PatchShape(const CarriedField& field, size_t triangle)
        : f_(field.view), patch_(field_patch(field.carrier, triangle)) {
        double middle[3] = {}, place[3][3], gradient[3][3];
        for (int k = 0; k < 3; ++k)
            for (int c = 0; c < 3; ++c) {
                place[k][c] = static_cast<double>(patch_.point[k][c]);
                gradient[k][c] = static_cast<double>(patch_.gradient[k][c]);
                middle[c] += place[k][c] / 3.0;
            }
        const SplineJet jet = spline_jet(f_, middle);
        Vector at[3];
        for (int k = 0; k < 3; ++k) at[k] = to_world(place[k]);
        m_.point = to_world(middle);
        m_.area = 0.5 * length(cross(at[1] - at[0], at[2] - at[0]));
        m_.radius = 0.0;
        for (const Vector& p : at) m_.radius = std::max(m_.radius, length(p - m_.point));
        const Vector g = covector(jet.gradient);
        const double slope = std::max(length(g), 1e-30);
        m_.normal = g * (1.0 / slope);
        bend(jet.hessian, slope);
        // Corners may have other normals than the Hessian of the middle says
        m_.spread = 1.5 * m_.radius * std::sqrt(square_of_bend());
        for (const auto& corner : gradient) {
            const Vector other = covector(corner);
            const Vector turned = other * (1.0 / std::max(length(other), 1e-30)) - m_.normal;
            m_.spread = std::max(m_.spread, 1.5 * length(turned));
        }
        m_.inside = f_.inside;
        m_.largest = largest_curvature();
    }
    const PatchMiddle& middle() const { return m_; }
    const FieldPatch& patch() const { return patch_; }

 private:
    Vector to_world(const double (&p)[3]) const {
        double out[3];
        f_.place_in_world(p, out);
        return {out[0], out[1], out[2]};
    }
    Vector covector(const double (&g)[3]) const {
        double out[3];
        f_.gradient_in_world(g, out);
        return {out[0], out[1], out[2]};
    }
    void bend(const double (&h)[6], double slope) {
        const double full[3][3] = {{h[0], h[5], h[4]}, {h[5], h[1], h[3]}, {h[4], h[3], h[2]}};
        const auto entry = [&](int a, int b) {
            double sum = 0.0;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) sum += f_.to_grid[i][a] * full[i][j] * f_.to_grid[j][b];
            return sum / slope;
        };
        const int places[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
        for (int k = 0; k < 6; ++k) m_.bend[k] = entry(places[k][0], places[k][1]);
    }
    double square_of_bend() const {
        const auto& b = m_.bend;
        return b[0] * b[0] + b[1] * b[1] + b[2] * b[2] + 2.0 * (b[3] * b[3] + b[4] * b[4] + b[5] * b[5]);
    }
    // The larger eigenvalue of the bend within the tangent plane, or the larger size of both.
    double largest_curvature() const {
        const Vector n = m_.normal, off = std::abs(n.x) < 0.6 ? Vector{1, 0, 0} : Vector{0, 1, 0};
        Vector a = cross(n, off);
        a = a * (1.0 / length(a));
        const Vector b = cross(n, a), both = a + b;
        const double aa = m_.curvature(a), bb = m_.curvature(b), ab = 0.5 * (m_.curvature(both) - aa - bb);
        const double mean = 0.5 * (aa + bb);
        return (m_.inside ? std::abs(mean) : mean) + std::sqrt(0.25 * (aa - bb) * (aa - bb) + ab * ab);
    }

    const FieldView& f_;
    FieldPatch patch_;
    PatchMiddle m_;
};

// The curvature that a patch counts with. Within a patch it may be larger than in its middle.
double counted(double curvature, const PatchMiddle& m) {
    constexpr double kLeast = 0.1;
    return std::max(curvature, kLeast * m.spread / std::max(m.radius, 1e-30));
}

// The contribution of tangents towards lights: their irradiance over the angle that they fill, since a
// patch is touched by lines towards a light if the light is near its tangent planes.
double lit(const PatchMiddle& m, const std::vector<LightBound>& lights) {
    double sum = 0.0;
    for (const LightBound& light : lights) {
        const Vector way = light.distant ? light.center : light.center - m.point;
        const double d = std::max(length(way), 1e-30);
        const double reach = light.distant ? light.radius : std::min((light.radius + m.radius) / d, 1.0);
        const double height = dot(m.normal, way) / d;
        if (std::abs(height) > reach + m.spread + 1e-4) continue;
        const Vector flat = way * (1.0 / d) - m.normal * height;
        const double across = length(flat);
        const double bent = across > reach ? m.counted_curvature(flat * (1.0 / across)) : m.largest;
        sum += light.irradiance(d * d + light.radius * light.radius) * counted(bent, m) /
               std::max(reach + m.spread, 1e-6);
    }
    return sum;
}

// Points that cover the aperture evenly, shifted as a whole at random.
std::vector<LensPlace> lens_places(const CameraView& camera, uint32_t seed) {
    std::mt19937 random(seed ^ kLensSeed);
    const double shift_u = random() / 4294967296.0, shift_v = random() / 4294967296.0;
    std::vector<LensPlace> out;
    for (int k = 0; k < kLensPoints; ++k) {
        double inverse = 0.0, digit = 0.5;
        for (int rest = k; rest > 0; rest /= 2, digit *= 0.5) inverse += (rest % 2) * digit;
        const double u = (k + 0.5) / kLensPoints + shift_u, v = inverse + shift_v;
        out.push_back(lens_place(camera, u - std::floor(u), v - std::floor(v)));
    }
    return out;
}

bool blurs_outlines(const CameraView& camera) {
    return camera.aperture_radius > 0.0f && !is_panorama(camera.kind);
}

Intersections find_seen_outlines(const SceneView& scene, const EdgeList& edges,
                                 const std::vector<int32_t>& meshes, uint32_t seed) {
    const CameraView& camera = scene.camera;
    const bool blurs = blurs_outlines(camera);
    std::vector<LensPlace> lens = {{0.0f, 0.0f}};
    if (blurs) lens = lens_places(camera, seed);
    Intersections out;
    for_each_field(scene, edges, meshes, [&](const CarriedField& field) {
        for (const LensPlace& from : lens) {
            may_cancel();
            // A segment counts the field as both of its surfaces
            add_outline(field, camera_viewer(field.view, camera, from), LineSurface(field.face),
                        edges.threads, out);
            while (blurs && out.lens.size() < 2 * static_cast<size_t>(out.size()))
                out.lens.insert(out.lens.end(), {from.x, from.y});
        }
    });
    out.lens_points = static_cast<int32_t>(lens.size());
    return out;
}

Intersections find_lit_outlines(const SceneView& scene, const EdgeList& edges,
                                const std::vector<int32_t>& meshes) {
    Intersections out;
    const LightView& lights = scene.lights;
    for (int32_t light = 0; light < lights.count; ++light) {
        if (is_sized(lights.kind[light])) continue;
        const int32_t row = lights.index[light];
        const auto before = static_cast<size_t>(out.size());
        for_each_field(scene, edges, meshes, [&](const CarriedField& field) {
            add_outline(field, light_viewer(field.view, lights, row), LineSurface::light(row), edges.threads,
                        out);
        });
        // The weight is the length times a bound of the irradiance
        const LightNode& node = lights.nodes[lights.node_of[light]];
        for (size_t k = before; k < static_cast<size_t>(out.size()); ++k) {
            const float* p = &out.ends[6 * k];
            const Vector a = {p[0], p[1], p[2]}, b = {p[3], p[4], p[5]};
            const Vector way = a - Vector{node.center[0], node.center[1], node.center[2]};
            out.weights.push_back(length(b - a) * bound_of(node).irradiance(dot(way, way)));
        }
    }
    return out;
}

Intersections find_patches(const SceneView& scene, const EdgeList& edges, const std::vector<int32_t>& meshes,
                           TouchedBy by) {
    Intersections out;
    const bool by_lights = by == TouchedBy::kSizedLights;
    const std::vector<LightBound> lights = by_lights ? sized_lights(scene.lights) : std::vector<LightBound>{};
    if (by_lights && lights.empty()) return out;
    for_each_field(scene, edges, meshes, [&](const CarriedField& field) {
        const auto triangles = static_cast<int64_t>(field.carrier.triangle.size() / 3);
        struct Part {
            std::vector<FieldPatch> patches;
            std::vector<double> weights;
        };
        constexpr int64_t kBlock = 512;
        std::vector<Part> parts(static_cast<size_t>((triangles + kBlock - 1) / kBlock));
        parallel_for(edges.threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t block) {
            Part& part = parts[static_cast<size_t>(block)];
            for (int64_t k = block * kBlock; k < std::min(triangles, (block + 1) * kBlock); ++k) {
                const PatchShape shape(field, static_cast<size_t>(k));
                const PatchMiddle& m = shape.middle();
                const double weight = m.area * (by_lights ? lit(m, lights) : counted(m.largest, m));
                if (!(weight > 0.0)) continue;
                part.patches.push_back(shape.patch());
                part.weights.push_back(weight);
            }
        });
        for (const Part& part : parts) {
            out.patches.insert(out.patches.end(), part.patches.begin(), part.patches.end());
            out.weights.insert(out.weights.end(), part.weights.begin(), part.weights.end());
        }
        while (out.faces.size() < 2 * out.patches.size()) {
            out.faces.insert(out.faces.end(), 2, field.face);
            out.instances.insert(out.instances.end(), 2, -1);
        }
    });
    out.ends.resize(6 * out.patches.size());  // samples find their points on the patches
    return out;
}

FieldLines as_lines(const EdgeList& edges, Intersections found) {
    EdgesAndIntersections lines(edges.tables, std::move(found));
    Candidates all = lines.intersections();
    return {std::move(lines), std::move(all)};
}

}  // namespace

std::shared_ptr<const std::vector<FieldCarrier>> field_carriers(const SceneTables& tables, EdgeCache& kept,
                                                                int threads) {
    return kept.carriers.get(true, [&] {
        std::vector<FieldCarrier> all;
        for (const FieldTable& field : tables.fields) all.push_back(field_carrier(field.view(), threads));
        return all;
    });
}

std::shared_ptr<const Intersections> seen_outlines(const SceneView& scene, const EdgeList& edges,
                                                   const std::vector<int32_t>& meshes, uint32_t seed) {
    if (!blurs_outlines(scene.camera)) seed = 0;
    return edges.kept.seen_outlines.get({{scene.camera}, field_key(scene, edges, meshes), seed},
                                        [&] { return find_seen_outlines(scene, edges, meshes, seed); });
}

std::shared_ptr<const FieldLines> lit_outlines(const SceneView& scene, const EdgeList& edges,
                                               const std::vector<int32_t>& meshes) {
    return edges.kept.lit_outlines.get({field_key(scene, edges, meshes), edges.lights}, [&] {
        return as_lines(edges, find_lit_outlines(scene, edges, meshes));
    });
}

std::shared_ptr<const FieldLines> field_patches(const SceneView& scene, const EdgeList& edges,
                                                const std::vector<int32_t>& meshes, TouchedBy by) {
    const bool by_lights = by == TouchedBy::kSizedLights;
    auto& kept = by_lights ? edges.kept.lit_patches : edges.kept.patches;
    return kept.get({field_key(scene, edges, meshes), by_lights ? edges.lights : nullptr},
                    [&] { return as_lines(edges, find_patches(scene, edges, meshes, by)); });
}

}  // namespace edgegrad
