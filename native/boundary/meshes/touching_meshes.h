// Meshes that rest on each other: a face or an edge of one lies on a face of the other.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/tables.h"

namespace edgegrad {

struct MeshBoxes;
class MeshTrees;

using MeshPairs = std::vector<std::array<int32_t, 2>>;

// What moves, by visible mesh and by instance. An instance moves also if its mesh does.
struct MovingMeshes {
    std::vector<uint8_t> meshes, instances;
    bool operator==(const MovingMeshes&) const = default;
};

// The pairs (a, b), a <= b, of meshes that touch where one of the two moves and the other does not; a == b
// for instances of one mesh. They touch where an edge of one lies on a face of the other, up to rounding, and
// does not pass through it: then edges of the contact appear or vanish as the meshes part. That includes
// faces that overlap in one plane, because a border of the overlap is then an edge of one of them. Meshes
// that touch in points only are left out, because the contact then changes in second order. `boxes` and
// `trees` are those of the meshes.
MeshPairs touching_meshes(const SceneTables& tables, const MovingMeshes& moving, const MeshBoxes& boxes,
                          const MeshTrees& trees, int threads);

}  // namespace edgegrad
