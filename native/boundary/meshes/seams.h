// Seams: edges across which shading is discontinuous although the surface is flat.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether the edge's first two faces, which share a material, differ in an interpolated quantity that shading
// reads: shading normals at a common corner (custom split normals, sharp edges), UVs, colours or other
// attributes. An edge between two planes is also a seam if the material's transparency depends on the normal.
bool is_seam(const SceneTables& tables, int64_t edge);

}  // namespace edgegrad
