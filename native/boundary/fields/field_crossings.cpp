#include "boundary/fields/field_crossings.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "boundary/curves/edge_cache.h"
#include "boundary/fields/field_curves.h"
#include "boundary/meshes/face_cut.h"
#include "boundary/meshes/trees/box_pairs.h"
#include "scene/mesh_instances.h"
#include "sdf/crossing_point.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

Box box_of(const Triangle3& t) {
    Box box;
    for (const Vector& p : t.p) add_point(box, p);
    return box;
}

// Triangles of a mesh, or of the carrier of a field, with their bounds.
struct Facets {
    const FieldView* field = nullptr;  // null: a mesh
    int32_t instance = -1;
    std::vector<Triangle3> triangles;
    std::vector<uint32_t> face;
    std::vector<Box> boxes;
    Box box;

    void add(const Triangle3& t, uint32_t of_face) {
        triangles.push_back(t), face.push_back(of_face), boxes.push_back(box_of(t));
        box.add(boxes.back());
    }
};

Facets facets_of(const FieldView& field, const FieldCarrier& carrier, uint32_t face) {
    Facets out;
    out.field = &field;
    for (const Triangle3& t : placed_triangles(field, carrier)) out.add(t, face);
    return out;
}

// The faces of a copy of a mesh within a box.
Facets facets_of(const SceneTables& tables, int32_t mesh, int32_t instance, const Box& within, int threads) {
    Facets out;
    out.instance = instance;
    const Placement place = Placement::of(tables, instance);
    const auto add = [&](int32_t face) {
        const Triangle3 t(tables, face, place);
        if (box_of(t).meets(within)) out.add(t, static_cast<uint32_t>(face));
    };
    if (instance < 0) {
        const auto found = faces_in(tables, mesh, std::span<const Box>(&within, 1), threads);
        for (const int32_t face : found.front()) add(face);
    } else {
        const auto m = static_cast<size_t>(mesh);
        for (int32_t f = tables.mesh_first_face[m]; f < tables.mesh_first_face[m + 1]; ++f) add(f);
    }
    return out;
}

// An end of the line that two triangles share: a point of an edge of one of them.
struct LineEnd {
    Vector point;
    Vector from, way;  // the edge
    double part;
    bool of_second;

    double along(Vector axis) const { return dot(axis, point); }
};

// The edges of `t` that cross the plane of `other`. Signs alone decide, so that neighbours agree on their
// common edge also where it lies in the plane.
bool cut_edges(const Triangle3& t, const Triangle3& other, bool second, LineEnd (&ends)[2]) {
    double height[3];
    for (size_t k = 0; k < 3; ++k) height[k] = dot(other.normal, t.p[k] - other.p[0]);
    int found = 0;
    for (size_t k = 0; k < 3 && found < 2; ++k) {
        const size_t next = (k + 1) % 3;
        if ((height[k] < 0.0) == (height[next] < 0.0)) continue;
        const Vector way = t.p[next] - t.p[k];
        const double part = height[k] / (height[k] - height[next]);
        ends[found++] = {t.p[k] + way * part, t.p[k], way, part, second};
    }
    return found == 2;
}

// The line that two triangles share, in the direction of the product of their normals.
bool common_line(const Triangle3& one, const Triangle3& other, LineEnd (&ends)[2]) {
    const Vector axis = cross(one.normal, other.normal);
    const double scale2 = dot(one.normal, one.normal) * dot(other.normal, other.normal);
    if (!(dot(axis, axis) > kCrossingParallel * scale2)) return false;
    LineEnd a[2], b[2];
    if (!cut_edges(one, other, false, a) || !cut_edges(other, one, true, b)) return false;
    if (a[0].along(axis) > a[1].along(axis)) std::swap(a[0], a[1]);
    if (b[0].along(axis) > b[1].along(axis)) std::swap(b[0], b[1]);
    ends[0] = a[0].along(axis) >= b[0].along(axis) ? a[0] : b[0];
    ends[1] = a[1].along(axis) <= b[1].along(axis) ? a[1] : b[1];
    return ends[0].along(axis) < ends[1].along(axis);
}

// Moves an end from the triangles onto the curve. Neighbours share it, so that they have to move it alike:
// along the edge where that belongs to a mesh, else to the nearest point of the curve.
bool pull(const FieldView& field, const Facets& second, const Triangle3& other, LineEnd& end) {
    if (end.of_second && !second.field) {
        if (!pull_along_line(field, end.from, end.way, end.part)) return false;
        end.point = end.from + end.way * end.part;
        return true;
    }
    CrossedSurface surfaces[2] = {crossed_field(field), {second.field, other.p[0], other.normal}};
    if (!second.field) surfaces[1].normal = other.normal * (1.0 / length(other.normal));
    return pull_to_crossing(surfaces, end.point);
}

void search(const Facets& first, const Facets& second, int threads, Intersections& out) {
    if (!first.box.meets(second.box)) return;
    const BoxPairs tree(second.boxes);
    const auto count = static_cast<int64_t>(first.triangles.size());
    constexpr int64_t kBlock = 256;
    std::vector<Intersections> parts(static_cast<size_t>((count + kBlock - 1) / kBlock));
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t block) {
        std::vector<size_t> met;
        for (int64_t k = block * kBlock; k < std::min(count, (block + 1) * kBlock) && !cancelled(); ++k) {
            const auto at = static_cast<size_t>(k);
            if (!first.boxes[at].meets(second.box)) continue;
            met.clear();
            tree.visit(first.boxes[at], [&](size_t other) { met.push_back(other); });
            std::sort(met.begin(), met.end());
            for (const size_t other : met) {
                LineEnd ends[2];
                const Triangle3& facet = second.triangles[other];
                if (!common_line(first.triangles[at], facet, ends)) continue;
                if (!pull(*first.field, second, facet, ends[0]) ||
                    !pull(*first.field, second, facet, ends[1]))
                    continue;
                parts[static_cast<size_t>(block)].add({ends[0].point, ends[1].point}, {first.face[at]},
                                                      {second.face[other], second.instance});
            }
        }
    });
    out.add(parts);
}

}  // namespace

std::vector<Triangle3> placed_triangles(const FieldView& field, const FieldCarrier& carrier) {
    const auto corner = [&](size_t k) {
        const double* x = &carrier.point[3 * static_cast<size_t>(carrier.triangle[k])];
        const double grid[3] = {x[0], x[1], x[2]};
        double point[3];
        field.place_in_world(grid, point);
        return Vector{point[0], point[1], point[2]};
    };
    // Maps that mirror reverse the order of corners
    const auto& m = field.to_world;
    const Vector x = {m[0][0], m[1][0], m[2][0]}, y = {m[0][1], m[1][1], m[2][1]},
                 z = {m[0][2], m[1][2], m[2][2]};
    const bool mirrors = dot(cross(x, y), z) < 0.0;
    std::vector<Triangle3> out;
    out.reserve(carrier.triangle.size() / 3);
    for (size_t k = 0; k + 2 < carrier.triangle.size(); k += 3)
        out.emplace_back(corner(k), corner(mirrors ? k + 2 : k + 1), corner(mirrors ? k + 1 : k + 2));
    return out;
}

Intersections field_crossings(const EdgeList& edges, const RequestedMotion& motion, int32_t seers) {
    const SceneTables& t = edges.tables;
    Intersections out;
    if (t.first_field() == 0 && t.fields.size() < 2) return out;  // nothing else is there
    const auto carriers = field_carriers(t, edges.kept, edges.threads);
    const std::vector<uint8_t> moving = moving_meshes(t, motion);
    const auto instances = mesh_instances(t);
    const auto seen = [&](int32_t mesh) { return (t.mesh_mask[static_cast<size_t>(mesh)] & seers) != 0; };
    std::vector<FieldView> views;
    for (const FieldTable& field : t.fields) views.push_back(field.view());
    std::vector<Facets> fields(t.fields.size());
    const auto mesh_of_field = [&](size_t k) { return t.first_field() + static_cast<int32_t>(k); };
    for (size_t k = 0; k < fields.size(); ++k)
        if (seen(mesh_of_field(k)))
            fields[k] = facets_of(views[k], (*carriers)[k],
                                  static_cast<uint32_t>(t.first_field_face()) + static_cast<uint32_t>(k));
    for (size_t k = 0; k < fields.size(); ++k) {
        if (fields[k].triangles.empty()) continue;
        may_cancel();
        const bool moves = motion.camera || motion.fields[k];
        for (size_t j = k + 1; j < fields.size(); ++j)
            if (moves || motion.fields[j]) search(fields[k], fields[j], edges.threads, out);
        for (int32_t mesh = 0; mesh < t.first_field(); ++mesh) {
            const auto m = static_cast<size_t>(mesh);
            if (!seen(mesh) || !(moves || moving[m])) continue;
            for (const int32_t instance : instances[m])
                search(fields[k], facets_of(t, mesh, instance, fields[k].box, edges.threads), edges.threads,
                       out);
        }
    }
    return out;
}

}  // namespace edgegrad
