// Seams: edges across which a surface's shading jumps though it lies in one plane.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether the edge's first two faces, of one material, differ in what shading interpolates over them: other
// shading normals at a common corner (custom split normals, sharp edges), or other UVs, colours or other
// attributes that the material may read; or lie in two planes while what they let through reads their
// normals.
bool is_seam(const SceneTables& tables, int64_t edge);

}  // namespace edgegrad
