#include "boundary/curves/mesh_intersections.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "boundary/meshes/face_cut.h"
#include "scene/mesh_instances.h"

namespace edgegrad {
namespace {

// The pairs of instances whose boxes overlap and for which requested(one, other) holds, sorted by their lower
// bounds along the axis of largest spread.
template <typename Requested>
std::vector<BoxPair> meeting_pairs(const std::vector<PlacedMesh>& meshes, const Requested& requested) {
    Box middles;
    for (const PlacedMesh& placed : meshes)
        add_point(middles, (vector_at(placed.box.low) + vector_at(placed.box.high)) * 0.5);
    int axis = 0;
    for (int c = 1; c < 3; ++c)
        if (middles.high[c] - middles.low[c] > middles.high[axis] - middles.low[axis]) axis = c;
    // Instances are large, so their bounds are sorted apart from them
    std::vector<std::pair<float, size_t>> order;
    for (size_t k = 0; k < meshes.size(); ++k) order.emplace_back(meshes[k].box.low[axis], k);
    std::sort(order.begin(), order.end());
    std::vector<Box> boxes;
    for (const auto& [low, k] : order) boxes.push_back(meshes[k].box);
    std::vector<BoxPair> out = BoxPairs(boxes).pairs(
        [&](size_t a, size_t b) { return requested(meshes[order[a].second], meshes[order[b].second]); });
    for (auto& [one, other] : out) one = order[one].second, other = order[other].second;
    return out;
}

using FacePair = std::array<int32_t, 2>;

// A line that two faces share.
struct SharedLine {
    FacePair faces;
    Vector ends[2];
};

// What the search of a part of two meshes has found.
struct Met {
    std::vector<SharedLine> lines;
    std::vector<FacePair> coincident;  // the first pair of faces that coincide, or none
};

Met search_part(const SceneTables& tables, const NearMeshes& near, FaceTree::Pair part) {
    Met met;
    // Copies that coincide are not looked for.
    const bool coincidence = near.one->instance < 0 && near.other->instance < 0;
    std::optional<Triangle3> s;
    int32_t of_s = -1;  // several pairs in turn have the same first face
    near.visit(part, [&](int32_t face, int32_t of_other) {
        if (std::exchange(of_s, face) != face) s.emplace(tables, face, near.one->place);
        const Triangle3 t(tables, of_other, near.other->place);
        SharedLine line{{face, of_other}, {}};
        if (shared_line(*s, t, line.ends))
            met.lines.push_back(line);
        else if (coincidence && (met.coincident.empty() || line.faces < met.coincident.front()) &&
                 coincide(*s, t))
            met.coincident.assign(1, line.faces);
        return true;
    });
    return met;
}

}  // namespace

void place_intersections(const SceneTables& tables, const Intersections& own,
                         std::span<const int32_t> instances, Intersections& out) {
    for (int32_t instance : instances) {
        may_cancel();
        const Placement place = Placement::of(tables, instance);
        for (size_t k = 0; k < own.faces.size(); k += 2) {
            Vector ends[2];
            const Triangle3 one(tables, static_cast<int32_t>(own.faces[k]), place);
            const Triangle3 other(tables, static_cast<int32_t>(own.faces[k + 1]), place);
            if (shared_line(one, other, ends))
                out.add(ends, {own.faces[k], instance}, {own.faces[k + 1], instance});
        }
    }
}

void search_pairs(const SceneTables& tables, const MeshBoxes& boxes, const MeshTrees& trees,
                  const RequestedMotion& motion, int32_t seers, int threads, Intersections& out) {
    const auto instances = mesh_instances(tables);
    // List all meshes and copies that the rays see
    std::vector<PlacedMesh> meshes;
    for (size_t m = 0; m < instances.size(); ++m) {
        if (!(tables.mesh_mask[m] & seers) || boxes.of[m].is_empty()) continue;
        for (const int32_t instance : instances[m])
            meshes.emplace_back(tables, static_cast<int32_t>(m), instance, boxes.of[m]);
    }
    // Select the pairs that may move and whose boxes overlap
    const auto moves = [&](const PlacedMesh& placed) {
        return motion.moving[static_cast<size_t>(placed.mesh)] || (motion.instances && placed.instance >= 0);
    };
    const std::vector<BoxPair> pairs =
        meeting_pairs(meshes, [&](const PlacedMesh& one, const PlacedMesh& other) {
            return motion.camera || moves(one) || moves(other);
        });
    std::vector<Met> found(pairs.size());
    std::mutex lock;
    search_near(trees, meshes, pairs, threads, [&](size_t k, const NearMeshes& near, FaceTree::Pair part) {
        const Met met = search_part(tables, near, part);
        const std::lock_guard<std::mutex> guard(lock);
        found[k].lines.insert(found[k].lines.end(), met.lines.begin(), met.lines.end());
        found[k].coincident.insert(found[k].coincident.end(), met.coincident.begin(), met.coincident.end());
    });
    // List the lines in an order that does not depend on the trees and threads
    for (size_t k = 0; k < pairs.size(); ++k) {
        auto& [lines, coincident] = found[k];
        const int32_t one = meshes[pairs[k][0]].instance, other = meshes[pairs[k][1]].instance;
        std::sort(lines.begin(), lines.end(),
                  [](const SharedLine& a, const SharedLine& b) { return a.faces < b.faces; });
        for (const SharedLine& line : lines)
            out.add(line.ends, {static_cast<uint32_t>(line.faces[0]), one},
                    {static_cast<uint32_t>(line.faces[1]), other});
        if (!coincident.empty()) out.coincident.push_back(*std::ranges::min_element(coincident));
    }
}

}  // namespace edgegrad
