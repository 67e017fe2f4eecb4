// Which meshes are solid bodies seen from outside: what lies inside them is hardly ever seen.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether each visible mesh is closed: every edge has two faces, wound in opposite directions along it.
std::vector<uint8_t> closed_meshes(const SceneTables& tables);

// By mesh, the side its faces look to: +1 outwards, -1 inwards (signed volume); 0 if it is not closed,
// or the camera's place is within its bounds. Only a hint for the distribution of samples: where it is
// wrong (a mesh that crosses itself turns parts of itself inside out) there is more noise, no error.
std::vector<int8_t> solid_sides(const SceneTables& tables, const std::vector<uint8_t>& closed);

}  // namespace edgegrad
