#include "boundary/meshes/trees/mesh_trees.h"

#include <cmath>
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
    : one(&a), other(&b), mapped_(a.place.matrix || b.place.matrix) {
    const Box common = common_box(a, b);
    common_ = a.local(common);
    origin_ = b.local(a.place({0, 0, 0}));
    const Vector columns[3] = {b.local(a.place({1, 0, 0})) - origin_, b.local(a.place({0, 1, 0})) - origin_,
                               b.local(a.place({0, 0, 1})) - origin_};
    slack_ = std::max(rounding_of(b.local(a.box)), rounding_of(b.local(b.box)));
    rows_[0] = {columns[0].x, columns[1].x, columns[2].x};
    rows_[1] = {columns[0].y, columns[1].y, columns[2].y};
    rows_[2] = {columns[0].z, columns[1].z, columns[2].z};
    tree = trees.within(a.mesh, common_, threads);
    if (tree->size() > 0) other_tree = trees.within(b.mesh, b.local(common), threads);
}

Box NearMeshes::map_box(const Box& box) const {
    const Vector low = vector_at(box.low), high = vector_at(box.high);
    const Vector middle = (low + high) * 0.5, half = (high - low) * 0.5;
    Box out;
    const double origin[3] = {origin_.x, origin_.y, origin_.z};
    for (int c = 0; c < 3; ++c) {
        const Vector& row = rows_[c];
        const double at = dot(row, middle) + origin[c];
        const double reach = std::abs(row.x) * half.x + std::abs(row.y) * half.y + std::abs(row.z) * half.z;
        out.low[c] = static_cast<float>(at - reach), out.high[c] = static_cast<float>(at + reach);
    }
    return out;
}

std::vector<FaceTree::Pair> NearMeshes::parts() const {
    constexpr size_t kFacesOfPart = 512, kMostParts = 4096;
    if (!other_tree) return {};
    return tree->pairs(*other_tree, *this,
                       std::clamp<size_t>((tree->size() + other_tree->size()) / kFacesOfPart, 1, kMostParts));
}

}  // namespace edgegrad
