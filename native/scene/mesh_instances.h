// The instances of each mesh.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// The instances of each visible mesh. A mesh without instances counts as one copy, -1.
inline std::vector<std::vector<int32_t>> mesh_instances(const GeometryTables& t) {
    std::vector<std::vector<int32_t>> out(static_cast<size_t>(t.visible_meshes));
    for (size_t k = 0; k < t.instance_mesh.size(); ++k)
        out[static_cast<size_t>(t.instance_mesh[k])].push_back(static_cast<int32_t>(k));
    for (std::vector<int32_t>& copies : out)
        if (copies.empty()) copies.push_back(-1);
    return out;
}

// Returns whether a mesh with these copies is instanced.
inline bool is_placed(const std::vector<int32_t>& copies) { return copies.front() >= 0; }

// By visible mesh whether it, or what places it, moves.
inline std::vector<uint8_t> moving_meshes(const GeometryTables& t, const RequestedMotion& motion) {
    std::vector<uint8_t> out = motion.moving;
    if (!motion.instances) return out;
    for (int32_t mesh : t.instance_mesh) out[static_cast<size_t>(mesh)] = 1;
    return out;
}

}  // namespace edgegrad
