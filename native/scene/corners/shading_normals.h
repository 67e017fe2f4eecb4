// Shading normals that follow the motion of vertices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/tables.h"

namespace edgegrad {

// Updates all shading normals (unit). Given normals stay. The normals of other meshes are the sums of the
// normals of adjacent faces, weighted by the angles at the corners (Thürmer and Wüthrich 1998), as in
// Blender.
void update_shading_normals(SceneTables& tables, int threads);

// The unit normals of the groups of corners of one mesh, three numbers each; zero where they cancel.
std::vector<double> angle_weighted_normals(const double* vertices, const int32_t* faces,
                                           const int32_t* groups, size_t face_count, size_t group_count);

// Their derivative. `push` adds to the tangents of the normals (N, 3), given the tangents of the vertices (V,
// 3). `pull` adds to the gradients of the vertices, given those of the normals. Given normals do not depend
// on vertices.
void push_shading_normals(const SceneTables& tables, int threads, const double* vertices, double* normals);
void pull_shading_normals(const SceneTables& tables, int threads, const double* normals, double* vertices);

}  // namespace edgegrad
