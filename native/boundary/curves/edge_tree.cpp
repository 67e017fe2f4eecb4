#include "boundary/curves/edge_tree.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "boundary/meshes/seams.h"
#include "boundary/meshes/trees/placement.h"
#include "scene/lights/light_tree.h"
#include "tasks/edge_tree_view.h"

namespace edgegrad {
namespace {

// About how many segments the edges are cut into. More segments have tighter bounds as seen from a shading
// point, but make the tree larger.
constexpr double kSegments = 128.0;

void put(float* out, Vector v) {
    out[0] = static_cast<float>(v.x), out[1] = static_cast<float>(v.y), out[2] = static_cast<float>(v.z);
}

// An edge from a along t, with the cone about `axis` that contains the normals of its faces and the
// directions between them. A line perpendicular to one of these directions sees the edge as a silhouette.
struct EdgeCone {
    Vector a, t, axis;
    double cosine;     // of the cone's half angle; -1 for all directions
    Vector normal[2];  // the normals of both faces, unit; unset for all directions
};

EdgeCone edge_cone(const SceneView& scene, const SceneTables& tables, int64_t edge, int32_t instance,
                   bool emitters) {
    const Placement place = Placement::of(scene, instance);
    const EdgeEnds ends = EdgeEnds::of(scene, place, edge);
    EdgeCone cone{ends.a, ends.b - ends.a, {1.0, 0.0, 0.0}, -1.0, {}};
    const uint32_t first = scene.edge_face_first[edge];
    if (scene.edge_face_first[edge + 1] - first != 2) return cone;
    // Faces of different transparency are a shadow boundary from all sides. Faces of different emission are a
    // boundary of the emitter from all sides.
    const auto material = [&](uint32_t k) { return scene.face_material[scene.edge_faces[k]]; };
    const bool differ = material(first) != material(first + 1);
    if ((scene.all_flags & kHasTransparency) && (differ || is_seam(tables, edge))) return cone;
    if (differ && emitters) return cone;
    Vector normal[2];
    for (uint32_t k = 0; k < 2; ++k) {
        const Vector third = place(vertex(scene, scene.edge_opposite[first + k])) - cone.a;
        const Vector n = k == 0 ? cross(cone.t, third) : cross(third, cone.t);
        if (!(length(n) > 0.0)) return cone;  // a face without area
        normal[k] = n * (1.0 / length(n));
    }
    const Vector middle = normal[0] + normal[1];
    if (length(middle) < 1e-6) return cone;
    cone.axis = middle * (1.0 / length(middle));
    cone.normal[0] = normal[0], cone.normal[1] = normal[1];
    // Widen the cone, so that rounding cannot exclude a silhouette.
    cone.cosine =
        std::cos(std::min(std::acos(std::clamp(dot(cone.axis, normal[0]), -1.0, 1.0)) + 1e-3, 3.14159265));
    return cone;
}

// The nodes nearest to the root, largest power first, that together cover the tree. Their weights are
// computed once for all candidates of a shading point.
std::vector<int32_t> top_nodes(const std::vector<LightNode>& nodes) {
    std::vector<int32_t> top{0};
    while (top.size() < static_cast<size_t>(kMostTopNodes)) {
        int32_t* widest = nullptr;
        for (int32_t& k : top) {
            const auto power = [&](int32_t node) { return nodes[static_cast<size_t>(node)].power; };
            if (nodes[static_cast<size_t>(k)].child >= 0 && (!widest || power(k) > power(*widest)))
                widest = &k;
        }
        if (!widest) break;
        const int32_t child = nodes[static_cast<size_t>(*widest)].child;
        *widest = child;
        top.push_back(child + 1);
    }
    return top;
}

}  // namespace

EdgeTree::EdgeTree(const SceneView& scene, const SceneTables& tables, const Candidates& edges, bool emitters)
    : mass_(static_cast<float>(edges.mass())) {
    // Make the leaves: cut each edge into segments in proportion to its weight
    std::vector<LightNode> leaves;
    for (int64_t k = 0; k < edges.size(); ++k) {
        const auto i = static_cast<size_t>(k);
        const double mass = edges.cumulative[i + 1] - edges.cumulative[i];
        const int32_t edge = edges.edge[i], instance = edges.instance.empty() ? -1 : edges.instance[i];
        const EdgeCone cone = edge_cone(scene, tables, edge, instance, emitters);
        const auto parts = static_cast<int64_t>(std::max(1.0, std::round(kSegments * mass / edges.mass())));
        LightNode leaf{};
        put(leaf.axis, cone.axis);
        leaf.cos_o = static_cast<float>(cone.cosine);
        leaf.sin_o = static_cast<float>(std::sqrt(std::max(0.0, 1.0 - cone.cosine * cone.cosine)));
        leaf.cos_e = 1.0f;
        leaf.two_sided = 1;
        leaf.power = static_cast<float>(mass / static_cast<double>(parts));
        leaf.radius = static_cast<float>(0.5 * length(cone.t) / static_cast<double>(parts)) * 1.00001f;
        float row[kSegmentColumns];
        put(row + kSegmentFrom, cone.a);
        put(row + kSegmentAlong, cone.t);
        put(row + kSegmentNormal, cone.normal[0]);
        put(row + kSegmentNormal + 3, cone.normal[1]);
        std::memcpy(row + kSegmentEdge, &edge, sizeof edge);
        std::memcpy(row + kSegmentInstance, &instance, sizeof instance);
        for (int64_t part = 0; part < parts; ++part) {
            const double u0 = static_cast<double>(part) / static_cast<double>(parts);
            const double u1 = static_cast<double>(part + 1) / static_cast<double>(parts);
            put(leaf.center, cone.a + cone.t * (0.5 * (u0 + u1)));
            leaf.child = -1 - static_cast<int32_t>(leaves.size());
            leaves.push_back(leaf);
            row[kSegmentU0] = static_cast<float>(u0), row[kSegmentU1] = static_cast<float>(u1);
            segments_.insert(segments_.end(), row, row + kSegmentColumns);
        }
    }
    // Build the tree
    nodes_ = light_tree(std::move(leaves), 0);
    top_ = top_nodes(nodes_);
}

}  // namespace edgegrad
