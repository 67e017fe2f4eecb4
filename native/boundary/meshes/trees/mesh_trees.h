// Trees of the faces of a scene's meshes, and the search for places where two meshes may meet.
#pragma once

#include <algorithm>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "boundary/meshes/trees/box_pairs.h"
#include "boundary/meshes/trees/face_tree.h"
#include "boundary/meshes/trees/placement.h"
#include "util/parallel.h"

namespace edgegrad {

// The trees that the searches of one call share, each made when a search needs it. Searches may run in
// parallel.
class MeshTrees {
 public:
    explicit MeshTrees(const SceneTables& tables);

    // The tree of all faces of a mesh.
    std::shared_ptr<const FaceTree> of(int32_t mesh, int threads) const;
    // A tree that contains at least the faces of a mesh whose boxes overlap `box`.
    std::shared_ptr<const FaceTree> within(int32_t mesh, const Box& box, int threads) const;

 private:
    // So many searches of a mesh look at all of its faces before it gets a tree, which costs as much as a few
    // of them.
    static constexpr int kFewSearches = 4;
    // Meshes of fewer faces get a tree at once.
    static constexpr size_t kSmallMesh = 64;

    struct Slot {
        std::mutex lock;
        std::shared_ptr<const FaceTree> tree;
        int searches = 0;
    };

    const SceneTables& tables_;
    std::unique_ptr<Slot[]> slots_;  // by mesh
};

// Two meshes, with trees of the faces that are near the other one.
struct NearMeshes {
    const PlacedMesh *one, *other;
    std::shared_ptr<const FaceTree> tree, other_tree;

    NearMeshes(const MeshTrees& trees, const PlacedMesh& a, const PlacedMesh& b, int threads);

    // Bounds a box of the one mesh in the other one's space. Boxes where they can't meet give empty ones.
    Box operator()(const Box& box) const {
        if (!box.meets(common_)) return {};
        Box out = mapped_ ? map_box(box) : box;
        for (int c = 0; c < 3; ++c) out.low[c] -= slack_, out.high[c] += slack_;
        return out;
    }
    // Pairs of nodes, which may be searched in parallel.
    std::vector<FaceTree::Pair> parts() const;
    // Calls visit_pair(face, face of the other mesh) for the pairs of faces of a part that may meet, until it
    // returns false.
    template <typename Visit>
    void visit(FaceTree::Pair part, const Visit& visit_pair) const {
        tree->visit_pairs(*other_tree, part, *this, visit_pair);
    }

 private:
    Box map_box(const Box& box) const;

    Box common_;  // where they may meet, in the one's space
    // The affine map from the one's space to the other one's: rows of its matrix, and where it takes 0.
    bool mapped_;
    Vector rows_[3], origin_;
    float slack_;  // by which rounding may move boxes in the other one's space
};

// Calls search(k, near, part) for the parts of each pair k of meshes, in parallel.
template <typename Search>
void search_near(const MeshTrees& trees, const std::vector<PlacedMesh>& meshes,
                 std::span<const BoxPair> pairs, int threads, const Search& search) {
    constexpr size_t kAtOnce = 1024;  // bounds the memory of trees that serve one pair alone
    for (size_t first = 0; first < pairs.size(); first += kAtOnce) {
        may_cancel();
        const std::span<const BoxPair> some = pairs.subspan(first, std::min(kAtOnce, pairs.size() - first));
        std::vector<std::unique_ptr<NearMeshes>> near(some.size());
        // Few pairs are those of large meshes, whose trees take several threads each
        const bool few = some.size() < 4 * static_cast<size_t>(threads);
        parallel_for(few ? 1 : threads, static_cast<int64_t>(some.size()), nullptr, [&](int, int64_t k) {
            const auto [a, b] = some[static_cast<size_t>(k)];
            near[static_cast<size_t>(k)] =
                std::make_unique<NearMeshes>(trees, meshes[a], meshes[b], few ? threads : 1);
        });
        std::vector<std::pair<size_t, FaceTree::Pair>> parts;
        for (size_t k = 0; k < near.size(); ++k)
            for (const FaceTree::Pair& part : near[k]->parts()) parts.emplace_back(k, part);
        parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t n) {
            const auto& [k, part] = parts[static_cast<size_t>(n)];
            if (!cancelled()) search(first + k, *near[k], part);
        });
    }
}

}  // namespace edgegrad
