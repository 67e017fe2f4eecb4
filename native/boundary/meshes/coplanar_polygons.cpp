#include "boundary/meshes/coplanar_polygons.h"

#include <algorithm>
#include <optional>

#include "scene/face_vectors.h"
#include "scene/view.h"

namespace edgegrad {
namespace {

// Vertices within this distance of a line are on it, relative to the length of the side.
constexpr double kOnLine = 1e-6;

struct Side {
    int32_t ends[2];
    Vector start, along, inward;  // unit vectors; inward lies in the polygon's plane
    double length, tolerance;
};

Vector vertex(const SceneTables& t, int32_t k) {
    const float* p = &t.vertices[3 * static_cast<size_t>(k)];
    return {p[0], p[1], p[2]};
}

double largest(Vector v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

Side make_side(const SceneTables& t, int32_t first, int32_t last, Vector normal) {
    Side s{{first, last}, vertex(t, first), {}, {}, 0.0, 0.0};
    const Vector way = vertex(t, last) - s.start;
    s.length = length(way);
    s.along = way * (1.0 / std::max(s.length, 1e-300));
    s.inward = cross(normal, s.along);
    s.tolerance = kOnLine * std::max(s.length, largest(s.start));
    return s;
}

// Extends a side by a border on the same line. Returns false if the border is on another line.
bool extend(const SceneTables& t, Side& s, const Side& border, Vector normal) {
    if (dot(s.along, border.along) <= 0.0) return false;
    for (int32_t end : border.ends)
        if (std::abs(dot(s.inward, vertex(t, end) - s.start)) > std::max(s.tolerance, border.tolerance))
            return false;
    const auto place = [&](int32_t end) { return dot(s.along, vertex(t, end) - s.start); };
    int32_t first = s.ends[0], last = s.ends[1];
    if (place(border.ends[0]) < 0.0) first = border.ends[0];
    if (place(border.ends[1]) > s.length) last = border.ends[1];
    if (first != s.ends[0] || last != s.ends[1]) s = make_side(t, first, last, normal);
    return true;
}

// The sides of the polygon that the faces form, if it is convex and has few of them.
std::optional<std::vector<Side>> sides_of(const SceneTables& t, const SurfaceRegions& regions,
                                          const std::vector<int32_t>& faces) {
    Vector normal = area_normal(t, static_cast<size_t>(faces.front()));
    normal = normal * (1.0 / std::max(length(normal), 1e-300));
    std::vector<Side> sides;
    std::vector<int32_t> ends;
    for (int32_t f : faces)
        for (size_t c = 0; c < 3; ++c) {
            const auto face = static_cast<size_t>(f);
            const int32_t edge = regions.face_edge[3 * face + c];
            if (edge < 0) return std::nullopt;
            // Shading may continue across a part of the side only
            if (!regions.next_on_side.empty() && regions.next_on_side[static_cast<size_t>(edge)] != edge)
                return std::nullopt;
            if (shading_continues(t, static_cast<size_t>(edge))) continue;
            const int32_t first = t.faces[3 * face + (c + 1) % 3], last = t.faces[3 * face + (c + 2) % 3];
            const Side border = make_side(t, first, last, normal);
            ends.push_back(first);
            if (std::any_of(sides.begin(), sides.end(),
                            [&](Side& s) { return extend(t, s, border, normal); }))
                continue;
            if (sides.size() == kPolygonSides) return std::nullopt;
            sides.push_back(border);
        }
    for (const Side& s : sides)
        for (int32_t end : ends)
            if (dot(s.inward, vertex(t, end) - s.start) < -s.tolerance) return std::nullopt;
    return sides.empty() ? std::nullopt : std::optional(sides);
}

}  // namespace

CoplanarPolygons coplanar_polygons(const SceneTables& t, const SurfaceRegions& regions) {
    const auto faces = static_cast<size_t>(t.mesh_first_face[static_cast<size_t>(t.visible_meshes)]);
    // Sort the faces by region
    std::vector<int32_t> order;
    for (size_t f = 0; f < faces; ++f)
        if (!is_smooth(t, f)) order.push_back(static_cast<int32_t>(f));
    const auto region = [&](int32_t f) { return regions.region[static_cast<size_t>(f)]; };
    std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) { return region(a) < region(b); });
    CoplanarPolygons out;
    for (size_t first = 0, last; first < order.size(); first = last) {
        for (last = first; last < order.size() && region(order[last]) == region(order[first]);) ++last;
        if (last - first < 2) continue;
        const std::vector<int32_t> group(order.begin() + static_cast<std::ptrdiff_t>(first),
                                         order.begin() + static_cast<std::ptrdiff_t>(last));
        const auto sides = sides_of(t, regions, group);
        if (!sides) continue;
        if (out.face.empty()) out.face.assign(t.faces.size() / 3, -1);
        for (int32_t f : group)
            out.face[static_cast<size_t>(f)] = static_cast<int32_t>(out.sides.size() / (2 * kPolygonSides));
        for (size_t k = 0; k < kPolygonSides; ++k)
            for (size_t end = 0; end < 2; ++end)
                out.sides.push_back(k < sides->size() ? (*sides)[k].ends[end] : -1);
    }
    return out;
}

}  // namespace edgegrad
