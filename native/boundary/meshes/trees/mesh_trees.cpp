#include "boundary/meshes/trees/mesh_trees.h"

#include <numeric>

namespace edgegrad {

MeshTrees::MeshTrees(const SceneTables& tables)
    : tables_(tables), slots_(std::make_unique<Slot[]>(static_cast<size_t>(tables.visible_meshes))) {}

std::shared_ptr<const FaceTree> MeshTrees::of(int32_t mesh, int threads) const {
    const auto m = static_cast<size_t>(mesh);
    const std::lock_guard<std::mutex> guard(slots_[m].lock);
    std::shared_ptr<const FaceTree>& tree = slots_[m].tree;
    if (!tree) {
        const int32_t first = tables_.mesh_first_face[m], last = tables_.mesh_first_face[m + 1];
        std::vector<int32_t> faces(static_cast<size_t>(last - first));
        std::iota(faces.begin(), faces.end(), first);
        tree = std::make_shared<FaceTree>(tables_, std::move(faces), threads);
    }
    return tree;
}

std::shared_ptr<const FaceTree> MeshTrees::within(int32_t mesh, const Box& box, int threads) const {
    const auto m = static_cast<size_t>(mesh);
    const auto count = static_cast<size_t>(tables_.mesh_first_face[m + 1] - tables_.mesh_first_face[m]);
    bool whole = count <= kSmallMesh;
    if (!whole) {
        const std::lock_guard<std::mutex> guard(slots_[m].lock);
        if (slots_[m].tree) return slots_[m].tree;
        whole = slots_[m].searches++ >= kFewSearches;
    }
    if (!whole) {
        std::vector<int32_t> faces = std::move(faces_in(tables_, mesh, {&box, 1}, threads).front());
        if (2 * faces.size() <= count) return std::make_shared<FaceTree>(tables_, std::move(faces), threads);
    }
    return of(mesh, threads);
}

NearMeshes::NearMeshes(const MeshTrees& trees, const PlacedMesh& a, const PlacedMesh& b, int threads)
    : one(&a), other(&b) {
    const Box common = common_box(a, b);
    tree = trees.within(a.mesh, a.local(common), threads);
    if (tree->size() > 0) other_tree = trees.within(b.mesh, b.local(common), threads);
}

std::vector<FaceTree::Pair> NearMeshes::parts() const {
    constexpr size_t kFacesOfPart = 512, kMostParts = 4096;
    if (!other_tree) return {};
    return tree->pairs(*other_tree, *this,
                       std::clamp<size_t>((tree->size() + other_tree->size()) / kFacesOfPart, 1, kMostParts));
}

}  // namespace edgegrad
