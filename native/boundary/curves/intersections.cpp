#include "boundary/curves/intersections.h"

#include <algorithm>
#include <numeric>

#include "boundary/curves/instance_intersections.h"
#include "boundary/curves/picture_frame.h"
#include "boundary/meshes/box_pairs.h"
#include "boundary/meshes/face_cut.h"
#include "boundary/meshes/star_shaped.h"
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

// Returns whether the faces share a line.
bool add_pair(const Triangle3& one, int32_t face, const Triangle3& two, int32_t other, Intersections& out) {
    Vector ends[2];
    if (!shared_line(one, two, ends)) return false;
    out.add(ends, {static_cast<uint32_t>(face)}, {static_cast<uint32_t>(other)});
    return true;
}

void search_pair(const SceneTables& tables, int32_t one, int32_t other, const Box& common, int threads,
                 Intersections& out) {
    const std::span<const Box> box(&common, 1);
    std::vector<int32_t> few = std::move(faces_in(tables, one, box, threads).front());
    if (few.empty()) return;
    std::vector<int32_t> many = std::move(faces_in(tables, other, box, threads).front());
    if (few.size() > many.size()) std::swap(few, many);
    if (few.empty()) return;
    const FaceTree tree(tables, std::move(many), threads);
    constexpr size_t kBlock = 256;
    std::vector<Intersections> parts((few.size() + kBlock - 1) / kBlock);
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t part) {
        const size_t first = static_cast<size_t>(part) * kBlock;
        Intersections& found = parts[static_cast<size_t>(part)];
        for (size_t k = first; k < std::min(few.size(), first + kBlock) && !cancelled(); ++k) {
            const Triangle3 face(tables, few[k]);
            tree.visit(box_of(tables, few[k]), [&](int32_t f) {
                const Triangle3 other(tables, f);
                if (!add_pair(face, few[k], other, f, found) && found.coincident.empty() &&
                    coincide(face, other))
                    found.coincident.push_back({few[k], f});
            });
        }
    });
    const size_t before = out.coincident.size();
    out.add(parts);
    if (out.coincident.size() > before) out.coincident.resize(before + 1);  // one serves
}

void search_self(const EdgeList& edges, int32_t mesh, Intersections& out) {
    const SceneTables& tables = edges.tables;
    const int threads = edges.threads;
    const auto m = static_cast<size_t>(mesh);
    if (tables.mesh_first_face[m + 1] - tables.mesh_first_face[m] > kSelfIntersectionFaces) return;
    // The test is far cheaper than the search.
    if (edges.closed[m] && is_star_shaped(tables, m, threads)) return;
    std::vector<int32_t> faces(
        static_cast<size_t>(tables.mesh_first_face[m + 1] - tables.mesh_first_face[m]));
    std::iota(faces.begin(), faces.end(), tables.mesh_first_face[m]);
    const FaceTree tree(tables, std::move(faces), threads);
    const std::vector<FaceTree::Pair> pairs = tree.pairs(256);
    std::vector<Intersections> parts(pairs.size());
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t k) {
        const auto part = static_cast<size_t>(k);
        tree.visit_pairs(pairs[part], [&](int32_t face, int32_t other) {
            if (neighbours(tables, face, other)) return;
            add_pair(Triangle3(tables, face), face, Triangle3(tables, other), other, parts[part]);
        });
    });
    out.add(parts);
}

}  // namespace

Intersections find_intersections(const EdgeList& edges, const RequestedMotion& motion, int32_t seers) {
    const SceneTables& tables = edges.tables;
    const int threads = edges.threads;
    const auto meshes = static_cast<size_t>(tables.visible_meshes);
    // Bound the meshes that the rays see and that are not instanced
    const auto own = edges.kept.boxes.get(true, [&] { return MeshBoxes(tables); });
    std::vector<Box> boxes(meshes);
    std::vector<uint8_t> seen(meshes);
    const auto instances = mesh_instances(tables);
    for (size_t m = 0; m < meshes; ++m) {
        seen[m] = !is_placed(instances[m]) && (tables.mesh_mask[m] & seers);
        if (seen[m]) boxes[m] = own->of[m];
    }
    Intersections out;
    // Meshes that no ray sees have empty boxes.
    const std::vector<BoxPair> pairs = BoxPairs(boxes).pairs(
        [&](size_t a, size_t b) { return motion.camera || motion.moving[a] || motion.moving[b]; });
    // Intersect each mesh with itself and with later meshes
    auto pair = pairs.begin();
    for (size_t a = 0; a < meshes; ++a) {
        may_cancel();
        if (seen[a] && (motion.camera || motion.moving[a])) search_self(edges, static_cast<int32_t>(a), out);
        for (; pair != pairs.end() && (*pair)[0] == a; ++pair) {
            const size_t b = (*pair)[1];
            Box common;
            for (int c = 0; c < 3; ++c) {
                common.low[c] = std::max(boxes[a].low[c], boxes[b].low[c]);
                common.high[c] = std::min(boxes[a].high[c], boxes[b].high[c]);
            }
            search_pair(tables, static_cast<int32_t>(a), static_cast<int32_t>(b), common, threads, out);
        }
    }
    // Intersect each instanced mesh with itself, and instances with other surfaces
    if (tables.instance_mesh.empty()) return out;
    for (size_t m = 0; m < meshes; ++m) {
        if (!is_placed(instances[m]) || !(tables.mesh_mask[m] & seers)) continue;
        if (!motion.camera && !motion.moving[m] && !motion.instances) continue;
        Intersections own;
        search_self(edges, static_cast<int32_t>(m), own);
        place_intersections(tables, own, instances[m], out);
    }
    search_instances(tables, motion, seers, threads, out);
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
