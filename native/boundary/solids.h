// Which meshes are solid bodies seen from outside: what lies inside them is hardly ever seen.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether each visible mesh is closed: every edge has two faces, wound in opposite directions along it.
std::vector<uint8_t> closed_meshes(const SceneTables& tables);

// By mesh, the side its faces look to: +1 outwards, -1 inwards (signed volume); 0 if it is not closed,
// or its bounds reach around the camera or to its near plane. Exact for a convex body; else a hint for the
// distribution of samples: where a mesh crosses itself and so turns parts of itself inside out, it costs
// noise, not truth.
std::vector<int8_t> solid_sides(const SceneTables& tables, const std::vector<uint8_t>& closed);

// Whether the faces of all visible meshes hang together through edges.
bool connected(const SceneTables& tables);

// Whether the scene is one convex body seen from outside, given `closed` and `connected`: a closed,
// connected surface of faces with an area, all of whose edges are convex, bounds a convex body. Nothing hides
// its light from it, and no shadow falls on it.
bool convex_alone(const SceneTables& tables, const std::vector<int8_t>& sides, bool is_connected);

}  // namespace edgegrad
