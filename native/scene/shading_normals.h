// Shading normals that follow the vertices.
#pragma once

#include <vector>

#include "scene/tables.h"

namespace edgegrad {

// All shading normals, unit: the given ones, and for the other meshes the sums of the normals of the faces
// that share them, weighted by the angles at the corners (Thürmer and Wüthrich 1998), as Blender has them.
void update_shading_normals(SceneTables& tables, int threads);

}  // namespace edgegrad
