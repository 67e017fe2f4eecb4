// The instances of each mesh.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "scene/tables.h"

namespace edgegrad {

// The instances of each visible mesh, in order. A mesh without instances counts as one copy, -1.
class MeshInstances {
 public:
    using Copies = std::span<const int32_t>;

    explicit MeshInstances(const GeometryTables& t) {
        const auto meshes = static_cast<size_t>(t.visible_meshes);
        std::vector<size_t> count(meshes, 0);
        for (const int32_t mesh : t.instance_mesh) ++count[static_cast<size_t>(mesh)];
        first_.resize(meshes + 1, 0);
        for (size_t m = 0; m < meshes; ++m) first_[m + 1] = first_[m] + std::max<size_t>(count[m], 1);
        copies_.assign(first_[meshes], -1);
        std::copy(first_.begin(), first_.end() - 1, count.begin());
        for (size_t k = 0; k < t.instance_mesh.size(); ++k)
            copies_[count[static_cast<size_t>(t.instance_mesh[k])]++] = static_cast<int32_t>(k);
    }
    size_t size() const { return first_.size() - 1; }
    Copies operator[](size_t mesh) const {
        return {copies_.data() + first_[mesh], copies_.data() + first_[mesh + 1]};
    }

 private:
    std::vector<size_t> first_;
    std::vector<int32_t> copies_;
};
inline MeshInstances mesh_instances(const GeometryTables& t) { return MeshInstances(t); }

// Returns whether a mesh with these copies is instanced.
inline bool is_placed(MeshInstances::Copies copies) { return copies.front() >= 0; }

// By visible mesh whether it, or what places it, moves.
inline std::vector<uint8_t> moving_meshes(const GeometryTables& t, const RequestedMotion& motion) {
    std::vector<uint8_t> out = motion.moving;
    if (!motion.instances) return out;
    for (int32_t mesh : t.instance_mesh) out[static_cast<size_t>(mesh)] = 1;
    return out;
}

// The same, and of the meshes that stand for distance fields whether their fields move.
inline std::vector<uint8_t> moving_surfaces(const SceneTables& t, const RequestedMotion& motion) {
    std::vector<uint8_t> out = moving_meshes(t, motion);
    for (size_t k = 0; k < motion.fields.size(); ++k)
        out[static_cast<size_t>(t.first_field()) + k] |= motion.fields[k];
    return out;
}

// The mesh that a face belongs to.
inline int32_t mesh_of(const SceneTables& tables, int32_t face) {
    const auto& first = tables.mesh_first_face;
    return static_cast<int32_t>(std::upper_bound(first.begin(), first.end(), face) - first.begin() - 1);
}

}  // namespace edgegrad
