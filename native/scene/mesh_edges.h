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

// The number of faces of an edge that are of the mesh of its first one. Edges in one place of several meshes
// have faces of all, those of their own mesh first (core/geometry/joint_edges.py).
inline uint32_t count_own_faces(const GeometryTables& t, size_t edge) {
    const uint32_t first = t.edge_face_first[edge], last = t.edge_face_first[edge + 1];
    if (t.edge_sharing.empty() || t.edge_sharing[edge] == 1) return last - first;
    const auto next_mesh = std::upper_bound(t.mesh_first_face.begin(), t.mesh_first_face.end(),
                                            static_cast<int32_t>(t.edge_faces[first]));
    const auto begin = static_cast<uint32_t>(next_mesh[-1]), end = static_cast<uint32_t>(*next_mesh);
    uint32_t count = 0;
    while (first + count < last && t.edge_faces[first + count] >= begin && t.edge_faces[first + count] < end)
        ++count;
    return count;
}

}  // namespace edgegrad
