// Shading normals that follow the motion of vertices.
#pragma once

#include <vector>

#include "scene/tables.h"

namespace edgegrad {

// Updates all shading normals (unit). Given normals stay. The normals of other meshes are the sums of the
// normals of adjacent faces, weighted by the angles at the corners (Thürmer and Wüthrich 1998), as in
// Blender.
void update_shading_normals(SceneTables& tables, int threads);

// Their derivative. `push` adds to the tangents of the normals (N, 3), given the tangents of the vertices (V,
// 3). `pull` adds to the gradients of the vertices, given those of the normals. Given normals do not depend
// on vertices.
void push_shading_normals(const SceneTables& tables, int threads, const double* vertices, double* normals);
void pull_shading_normals(const SceneTables& tables, int threads, const double* normals, double* vertices);

}  // namespace edgegrad
