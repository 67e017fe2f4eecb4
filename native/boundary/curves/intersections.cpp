#include "boundary/curves/intersections.h"

#include <algorithm>

#include "boundary/curves/mesh_intersections.h"
#include "boundary/curves/picture_frame.h"
#include "boundary/meshes/face_cut.h"
#include "boundary/meshes/star_shaped.h"
#include "boundary/meshes/trees/own_pairs.h"
#include "scene/mesh_instances.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Whether two faces share a corner, by position: welded vertices keep several numbers.
bool neighbours(const SceneTables& t, int32_t face, int32_t other) {
    for (size_t j = 0; j < 3; ++j)
        for (size_t k = 0; k < 3; ++k) {
            const float *p = corner(t, face, j), *q = corner(t, other, k);
            const float scale = std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
            const float d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
            if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= 1e-12f * scale * scale) return true;
        }
    return false;
}

// The intersections of a mesh with itself.
Intersections own_intersections(const EdgeList& edges, const MeshTrees& trees, int32_t mesh) {
    const SceneTables& tables = edges.tables;
    const int threads = edges.threads;
    const auto m = static_cast<size_t>(mesh);
    if (tables.mesh_first_face[m + 1] - tables.mesh_first_face[m] > kSelfIntersectionFaces) return {};
    // The test is far cheaper than the search.
    if (edges.closed[m] && is_star_shaped(tables, m, threads)) return {};
    const auto tree = trees.of(mesh, threads);
    const OwnPairs search(tables, *tree, threads);
    const std::vector<OwnPairs::Pair> pairs = search.parts(256);
    std::vector<Intersections> parts(pairs.size());
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t k) {
        const auto part = static_cast<size_t>(k);
        search.visit(pairs[part], [&](int32_t face, int32_t other) {
            if (neighbours(tables, face, other)) return;
            Vector ends[2];
            if (shared_line(Triangle3(tables, face), Triangle3(tables, other), ends))
                parts[part].add(ends, {static_cast<uint32_t>(face)}, {static_cast<uint32_t>(other)});
        });
    });
    Intersections out;
    out.add(parts);
    return out;
}

}  // namespace

Intersections find_intersections(const EdgeList& edges, const RequestedMotion& motion, int32_t seers) {
    const SceneTables& tables = edges.tables;
    const auto boxes = edges.kept.boxes.get(true, [&] { return MeshBoxes(tables); });
    const auto trees = edges.kept.trees.get(true, [&] { return MeshTrees(tables); });
    const auto instances = mesh_instances(tables);
    Intersections out;
    // Intersect each mesh with itself
    for (size_t m = 0; m < instances.size(); ++m) {
        may_cancel();
        if (!(tables.mesh_mask[m] & seers)) continue;
        const bool placed = is_placed(instances[m]);
        if (!motion.camera && !motion.moving[m] && !(placed && motion.instances)) continue;
        const Intersections own = own_intersections(edges, *trees, static_cast<int32_t>(m));
        if (placed)
            place_intersections(tables, own, instances[m], out);
        else
            out.add(own, 0, own.size());
    }
    // Intersect it with others
    search_pairs(tables, *boxes, *trees, motion, seers, edges.threads, out);
    return out;
}

Intersections moving_intersections(const SceneTables& tables, const RequestedMotion& motion,
                                   const Intersections& all) {
    if (motion.camera) return all;
    const auto moves = [&](size_t k) {
        if (motion.instances && all.instances[k] >= 0) return true;
        return motion.moving[static_cast<size_t>(mesh_of(tables, static_cast<int32_t>(all.faces[k])))] != 0;
    };
    Intersections out;
    for (int64_t k = 0; k < all.size(); ++k) {
        may_cancel();
        if (moves(static_cast<size_t>(2 * k)) || moves(static_cast<size_t>(2 * k + 1))) out.add(all, k);
    }
    out.coincident = all.coincident;
    return out;
}

EdgesAndIntersections::EdgesAndIntersections(const SceneTables& tables, Intersections intersections)
    : edge_count_(static_cast<int32_t>(tables.edge_vertices.size() / 2)),
      placed_(!tables.instance_mesh.empty()),
      intersections_(std::move(intersections)) {
    if (intersections_.size() == 0) return;
    face_first_ = tables.edge_face_first;
    faces_ = tables.edge_faces;
    faces_.insert(faces_.end(), intersections_.faces.begin(), intersections_.faces.end());
    for (int64_t k = 0; k < intersections_.size(); ++k) face_first_.push_back(face_first_.back() + 2);
}

SceneView EdgesAndIntersections::view(SceneView scene) const {
    if (intersections_.size() == 0) return scene;
    scene.edge_face_first = face_first_.data();
    scene.edge_faces = faces_.data();
    scene.intersection_ends = intersections_.ends.data();
    scene.intersection_instances = placed_ ? intersections_.instances.data() : nullptr;
    scene.line_lens = intersections_.lens.empty() ? nullptr : intersections_.lens.data();
    scene.lens_points = intersections_.lens_points;
    scene.field_patches = intersections_.patches.empty() ? nullptr : intersections_.patches.data();
    return scene;
}

Candidates EdgesAndIntersections::intersections() const {
    Candidates out;
    for (int64_t k = 0; k < intersections_.size(); ++k) {
        may_cancel();
        const float* p = &intersections_.ends[6 * static_cast<size_t>(k)];
        out.edge.push_back(edge_count_ + static_cast<int32_t>(k));
        out.u0.push_back(0.0f);
        out.u1.push_back(1.0f);
        const double weight = intersections_.weights.empty()
                                  ? length(Vector{p[3], p[4], p[5]} - Vector{p[0], p[1], p[2]})
                                  : intersections_.weights[static_cast<size_t>(k)];
        out.cumulative.push_back(out.mass() + weight);
    }
    return out;
}

void EdgesAndIntersections::add_candidates(const CameraView& camera, Candidates& candidates) const {
    const PictureFrame frame(camera);
    for (int64_t k = 0; k < intersections_.size(); ++k) {
        may_cancel();
        const float* p = &intersections_.ends[6 * static_cast<size_t>(k)];
        frame.visit_segments(
            {p[0], p[1], p[2]}, {p[3], p[4], p[5]}, [&](const PictureFrame::EdgeSegment& segment) {
                if (!(segment.pixels > 0.0)) return;
                candidates.instance.resize(candidates.edge.size(), -1);
                candidates.edge.push_back(edge_count_ + static_cast<int32_t>(k));
                candidates.instance.push_back(-1);
                candidates.u0.push_back(static_cast<float>(segment.u0));
                candidates.u1.push_back(static_cast<float>(segment.u1));
                candidates.cumulative.push_back(candidates.cumulative.back() + segment.pixels);
            });
    }
}

}  // namespace edgegrad
