// Bodies that are seen whole from a point inside of them: they don't pass through themselves.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether a closed mesh certainly is star-shaped about the middle of its bounds: every direction from there
// meets one face, from behind. Of a closed mesh all of whose faces are met from behind, all directions meet
// as many of them (the degree of its projection onto a sphere); where that is one, no two faces have a place
// in common but along their borders. Directions are kept by what scales and turns copies, so that copies of
// such a mesh don't cross themselves either.
bool is_star_shaped(const SceneTables& tables, size_t mesh, int threads);

}  // namespace edgegrad
