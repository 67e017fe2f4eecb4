// Shading normals that follow the vertices.
#pragma once

#include <vector>

#include "scene/tables.h"

namespace edgegrad {

// All shading normals, unit: the given ones, and for the other meshes the sums of the normals of the faces
// that share them, weighted by the angles at the corners (Thürmer and Wüthrich 1998), as Blender has them.
void update_shading_normals(SceneTables& tables, int threads);

// Their derivative: adds to the normals' tangents (N, 3) what the vertices' (V, 3) make of them, and to the
// vertices' gradients what the normals' give back. Given normals follow no vertex.
void push_shading_normals(const SceneTables& tables, int threads, const double* vertices, double* normals);
void pull_shading_normals(const SceneTables& tables, int threads, const double* normals, double* vertices);

}  // namespace edgegrad
