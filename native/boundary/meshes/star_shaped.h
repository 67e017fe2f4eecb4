// Star-shaped meshes: all of the surface is visible from one interior point, so the mesh does not intersect
// itself.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether a closed mesh is certainly star-shaped about the centre of its bounding box: every ray from there
// meets exactly one face, from behind. If all faces of a closed mesh are met from behind, all rays meet the
// same number of faces (the degree of the projection onto a sphere). If that number is one, faces share
// points only along their borders. Affine instance transforms preserve the property, so instances of such a
// mesh do not intersect themselves either.
bool is_star_shaped(const SceneTables& tables, size_t mesh, int threads);

}  // namespace edgegrad
