#include "boundary/curves/light_intersections.h"

#include <functional>
#include <numbers>
#include <set>
#include <variant>

#include "boundary/curves/mesh_intersections.h"
#include "boundary/meshes/face_cut.h"
#include "scene/lights/light_params.h"
#include "scene/mesh_instances.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Radians. Arcs are cut into chords of at most this angle. A shorter chord follows the arc more closely, but
// makes more lines.
constexpr double kArcSegment = std::numbers::pi / 8.0;

using VisitLine = std::function<void(const Vector& from, const Vector& to)>;

// A rectangle or an ellipse of the light table.
struct FlatLight {
    Vector center, x, y;  // half axes
    bool ellipse;
    Box box;

    FlatLight(const float* row, bool is_ellipse) : ellipse(is_ellipse) {
        const auto vector = [&](int at) { return Vector{row[at], row[at + 1], row[at + 2]}; };
        center = vector(kLightPosition);
        x = vector(kLightAxisX) * static_cast<double>(row[kLightExtentX]);
        y = vector(kLightAxisY) * static_cast<double>(row[kLightExtentY]);
        for (double s : {-1.0, 1.0})
            for (double t : {-1.0, 1.0}) {
                const Vector p = center + x * s + y * t;
                const float corner[3] = {static_cast<float>(p.x), static_cast<float>(p.y),
                                         static_cast<float>(p.z)};
                box.add(corner);
            }
    }

    // Whether a triangle lies in the light's plane, and on a part of the rectangle about the light.
    bool lies_on(const Triangle3& t) const {
        const Vector& side = dot(cross(x, y), t.normal) < 0.0 ? y : x;
        const Vector& other = &side == &x ? y : x;
        const Vector corner = center - side - other, far = center + side + other;
        return coincide(t, Triangle3(corner, corner + side * 2.0, far)) ||
               coincide(t, Triangle3(corner, far, corner + other * 2.0));
    }

    // Visits the line along which a triangle intersects the light. None if an edge of the triangle lies in
    // the light's plane.
    void cut_by(const Triangle3& t, const VisitLine& visit) const {
        Vector ends[2];
        const Vector normal = cross(x, y), along = cross(t.normal, normal);
        const double scale2 = dot(t.normal, t.normal) * dot(normal, normal);
        if (!(dot(along, along) > kParallel * scale2)) return;
        if (!cut(t, Triangle3(center, center + x, center + y), ends)) return;
        // Clip the segment a + b k, k from 0 to 1, to the light, in the frame of its half axes.
        const auto place = [&](const Vector& p, const Vector& axis) {
            return dot(p - center, axis) / dot(axis, axis);
        };
        const double a[2] = {place(ends[0], x), place(ends[0], y)};
        const double b[2] = {place(ends[1], x) - a[0], place(ends[1], y) - a[1]};
        double low = 0.0, high = 1.0;
        if (ellipse) {
            const double bb = b[0] * b[0] + b[1] * b[1], ab = a[0] * b[0] + a[1] * b[1];
            const double root = ab * ab - bb * (a[0] * a[0] + a[1] * a[1] - 1.0);
            if (!(root > 0.0)) return;
            low = std::max(low, (-ab - std::sqrt(root)) / bb);
            high = std::min(high, (-ab + std::sqrt(root)) / bb);
        } else {
            for (int c = 0; c < 2; ++c) {
                if (b[c] == 0.0) {
                    if (std::abs(a[c]) >= 1.0) return;
                    continue;
                }
                const double one = (-1.0 - a[c]) / b[c], other = (1.0 - a[c]) / b[c];
                low = std::max(low, std::min(one, other));
                high = std::min(high, std::max(one, other));
            }
        }
        if (!(high > low)) return;
        const Vector first = ends[0], way = ends[1] - ends[0];
        ends[0] = first + way * low;
        ends[1] = first + way * high;
        if (length(ends[1] - ends[0]) > kOnPlane * t.size) visit(ends[0], ends[1]);
    }
};

// The distance of a point from a triangle.
double distance_to(const Triangle3& t, const Vector& point) {
    bool above = dot(t.normal, t.normal) > 0.0;
    double nearest = 1e300;
    for (size_t k = 0; k < 3; ++k) {
        const Vector side = t.p[(k + 1) % 3] - t.p[k], way = point - t.p[k];
        above = above && dot(cross(t.normal, side), way) >= 0.0;
        const double share = std::clamp(dot(way, side) / std::max(dot(side, side), 1e-300), 0.0, 1.0);
        nearest = std::min(nearest, length(way - side * share));
    }
    return above ? std::abs(dot(t.normal, point - t.p[0])) / length(t.normal) : nearest;
}

// A sphere of the light table, or the ball that contains a disk in all of its orientations.
struct RoundLight {
    Vector center;
    double radius;
    bool disk;
    Box box;

    RoundLight(const float* row, bool is_disk)
        : center{row[kLightPosition], row[kLightPosition + 1], row[kLightPosition + 2]},
          radius(row[kLightRadius]),
          disk(is_disk) {
        for (double s : {-radius, radius}) {
            const float corner[3] = {static_cast<float>(center.x + s), static_cast<float>(center.y + s),
                                     static_cast<float>(center.z + s)};
            box.add(corner);
        }
    }

    // Visits the chords of the arcs along which a triangle intersects the sphere. For disks, visits one
    // placeholder line for each triangle that meets the ball.
    void cut_by(const Triangle3& t, const VisitLine& visit) const {
        if (disk) {
            double longest = 0.0;
            for (size_t k = 0; k < 3; ++k) longest = std::max(longest, length(t.p[(k + 1) % 3] - t.p[k]));
            if (longest > 0.0 && distance_to(t, center) < radius)
                visit(center, center + Vector{std::min(longest, 2.0 * radius), 0.0, 0.0});
            return;
        }
        const double area = length(t.normal);
        if (!(area > 0.0)) return;
        const Vector n = t.normal * (1.0 / area);
        const double height = dot(n, t.p[0] - center), ring2 = radius * radius - height * height;
        if (!(ring2 > kParallel * radius * radius)) return;
        const double ring = std::sqrt(ring2);
        const Vector middle = center + n * height, side = t.p[1] - t.p[0];
        const Vector x = side * (ring / length(side)), y = cross(n, x);
        // The circle is middle + x cos + y sin. Find where it crosses the triangle's sides.
        std::vector<double> turns{-std::numbers::pi, std::numbers::pi};
        double across[3][3];  // by side: signed distance inwards, as coefficients of 1, cos and sin
        for (size_t k = 0; k < 3; ++k) {
            const Vector inwards = cross(n, t.p[(k + 1) % 3] - t.p[k]);
            across[k][0] = dot(inwards, middle - t.p[k]);
            across[k][1] = dot(inwards, x), across[k][2] = dot(inwards, y);
            const double reach = std::hypot(across[k][1], across[k][2]);
            if (std::abs(across[k][0]) >= reach) continue;
            const double toward = std::atan2(across[k][2], across[k][1]);
            const double half = std::acos(-across[k][0] / reach);
            for (double turn : {toward - half, toward + half})
                turns.push_back(std::remainder(turn, 2.0 * std::numbers::pi));
        }
        std::sort(turns.begin(), turns.end());
        const auto at = [&](double turn) { return middle + x * std::cos(turn) + y * std::sin(turn); };
        // Visit the arcs inside the triangle
        for (size_t k = 0; k + 1 < turns.size(); ++k) {
            const double angle = turns[k + 1] - turns[k], half = turns[k] + 0.5 * angle;
            if (!(angle * ring > kOnPlane * t.size)) continue;
            const auto inside = [&](const double (&side_k)[3]) {
                return side_k[0] + side_k[1] * std::cos(half) + side_k[2] * std::sin(half) > 0.0;
            };
            if (!inside(across[0]) || !inside(across[1]) || !inside(across[2])) continue;
            const int chords = static_cast<int>(std::ceil(angle / kArcSegment));
            for (int j = 0; j < chords; ++j)
                visit(at(turns[k] + angle * j / chords), at(turns[k] + angle * (j + 1) / chords));
        }
    }
};

using SizedLight = std::variant<FlatLight, RoundLight>;

std::optional<SizedLight> sized_light(const SceneTables& tables, size_t row) {
    const int32_t kind = tables.lights.kind[row];
    const float* params = &tables.lights.params[kLightParams * row];
    if (kind == kRectangleLight || kind == kEllipseLight) return FlatLight(params, kind == kEllipseLight);
    if (kind == kSphereLight || kind == kDiskLight) return RoundLight(params, kind == kDiskLight);
    return std::nullopt;
}

Box box_of(const SizedLight& light) {
    return std::visit([](const auto& one) { return one.box; }, light);
}

// A light and the faces near it.
struct NearFaces {
    SizedLight light;
    size_t row;
    std::vector<IntersectedFace> faces;
};

std::vector<NearFaces> faces_near_lights(const SceneTables& tables, const RequestedPair& requested,
                                         int threads) {
    const auto instances = mesh_instances(tables);
    // List the lights that have a size
    std::vector<NearFaces> searches;
    for (size_t row = 0; row < tables.lights.kind.size(); ++row)
        if (auto light = sized_light(tables, row)) searches.push_back({*light, row, {}});
    // Find the faces near each light, mesh by mesh
    for (size_t m = 0; m < instances.size(); ++m) {
        may_cancel();
        const auto mesh = static_cast<int32_t>(m);
        std::vector<NearFaces*> searched;
        for (NearFaces& s : searches)
            if (requested(s.row, m)) searched.push_back(&s);
        if (searched.empty()) continue;
        const Box own = mesh_box(tables, m);
        // The lights near each instance, with their bounds in the mesh's space.
        std::vector<std::pair<NearFaces*, int32_t>> near;
        std::vector<Box> boxes;
        for (int32_t instance : instances[m]) {
            const PlacedMesh placed(tables, mesh, instance, own);
            for (NearFaces* s : searched) {
                const Box box = box_of(s->light);
                if (!placed.box.meets(box)) continue;
                near.emplace_back(s, instance);
                boxes.push_back(placed.local(box));
            }
        }
        if (near.empty()) continue;
        const auto found = faces_in(tables, mesh, boxes, threads);
        for (size_t k = 0; k < near.size(); ++k)
            for (int32_t face : found[k])
                near[k].first->faces.push_back({static_cast<uint32_t>(face), near[k].second});
    }
    return searches;
}

Triangle3 placed_face(const SceneTables& tables, const IntersectedFace& f) {
    return Triangle3(tables, static_cast<int32_t>(f.face), Placement::of(tables, f.instance));
}

}  // namespace

std::optional<Box> box_of_light(const SceneTables& tables, size_t row) {
    const auto light = sized_light(tables, row);
    return light ? std::optional(box_of(*light)) : std::nullopt;
}

bool any_through_light(const SceneTables& tables, size_t row, std::span<const Triangle3> surface) {
    const auto light = sized_light(tables, row);
    if (!light) return false;
    bool found = false;
    const VisitLine note = [&](const Vector&, const Vector&) { found = true; };
    for (const Triangle3& t : surface) {
        std::visit([&](const auto& one) { one.cut_by(t, note); }, *light);
        if (found) return true;
    }
    return false;
}

Intersections lines_through_lights(const SceneTables& tables, const RequestedPair& requested, int threads) {
    Intersections out;
    for (const NearFaces& s : faces_near_lights(tables, requested, threads))
        for (const IntersectedFace& f : s.faces) {
            const VisitLine add = [&](const Vector& from, const Vector& to) {
                out.add({from, to}, f, {LineSurface::light(static_cast<int32_t>(s.row)).bits()});
            };
            std::visit([&](const auto& light) { light.cut_by(placed_face(tables, f), add); }, s.light);
        }
    return out;
}

std::vector<std::array<int32_t, 2>> lights_on_faces(const SceneTables& tables, const RequestedPair& requested,
                                                    int threads) {
    std::set<std::array<int32_t, 2>> out;
    for (const NearFaces& s : faces_near_lights(tables, requested, threads)) {
        const auto* light = std::get_if<FlatLight>(&s.light);
        if (!light) continue;
        for (const IntersectedFace& f : s.faces)
            if (light->lies_on(placed_face(tables, f)))
                out.insert({static_cast<int32_t>(s.row), mesh_of(tables, static_cast<int32_t>(f.face))});
    }
    return {out.begin(), out.end()};
}

Intersections find_light_intersections(const SceneTables& tables, const RequestedMotion& motion,
                                       const Intersections& intersections, const int32_t* emissive,
                                       int threads) {
    Intersections out;
    for (int64_t k = 0; k < intersections.size() && emissive; ++k) {
        const uint32_t* faces = &intersections.faces[static_cast<size_t>(2 * k)];
        if (emissive[faces[0]] >= 0 || emissive[faces[1]] >= 0) out.add(intersections, k);
    }
    const std::vector<uint8_t> moving = moving_meshes(tables, motion);
    const Intersections rows = lines_through_lights(
        tables,
        [&](size_t row, size_t mesh) {
            // The part of a sphere that a point sees turns with the point, so any motion moves it relative to
            // surfaces.
            const int32_t kind = tables.lights.kind[row];
            return kind == kSphereLight || (kind != kDiskLight && (motion.lights || moving[mesh]));
        },
        threads);
    out.add(rows, 0, rows.size());
    return out;
}

Intersections find_disk_intersections(const SceneTables& tables, int threads) {
    return lines_through_lights(
        tables, [&](size_t row, size_t) { return tables.lights.kind[row] == kDiskLight; }, threads);
}

Intersections find_seen_lights(const SceneTables& tables, const RequestedMotion& motion, bool disks,
                               int threads) {
    const std::vector<uint8_t> moving = moving_meshes(tables, motion);
    return lines_through_lights(
        tables,
        [&](size_t row, size_t mesh) {
            if (tables.lights.kind[row] == kDiskLight && !disks) return false;
            return (motion.camera || motion.lights || moving[mesh]) &&
                   (tables.lights.visible_to[row] & tables.mesh_mask[mesh] & (1 << kCameraRay)) != 0;
        },
        threads);
}

}  // namespace edgegrad
