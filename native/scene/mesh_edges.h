// The edges of a mesh.
#pragma once

#include <algorithm>
#include <utility>

#include "scene/tables.h"

namespace edgegrad {

// The range of a mesh's edges: the first, and one after the last. Edges are in the order of their meshes.
inline std::pair<int64_t, int64_t> mesh_edges(const GeometryTables& t, size_t mesh) {
    const auto before = [&](int32_t face) {
        const auto first_face = [&](uint32_t first) {
            return t.edge_faces[first] < static_cast<uint32_t>(face);
        };
        const auto begin = t.edge_face_first.begin(), end = t.edge_face_first.end() - 1;
        return static_cast<int64_t>(std::partition_point(begin, end, first_face) - begin);
    };
    return {before(t.mesh_first_face[mesh]), before(t.mesh_first_face[mesh + 1])};
}

}  // namespace edgegrad
