// Bindings for the export of meshes: what is slow in numpy for millions of triangles.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

// The shading normals that a mesh without normals of its own gets, (count, 3)
// (scene/corners/shading_normals.h). `smoothing` names the normal of each corner of a face, -1: none.
nanobind::object angle_weighted_normals(nanobind::handle vertices, nanobind::handle faces,
                                        nanobind::handle smoothing, int64_t count);

// Tangents and signs of the corners of a mesh, (m, 3, 4) (scene/corners/corner_tangents.h). `smoothing` as
// above.
nanobind::object corner_tangents(nanobind::handle vertices, nanobind::handle faces, nanobind::handle uv,
                                 nanobind::handle smoothing, nanobind::handle normals, bool around,
                                 int threads);

// Numbers equal keys equally, from 0 in the order of their first appearance. Returns the number of each key,
// (n,), and the index of the first key of each number. The keys are hashes: their bits are random.
nanobind::tuple number_equal_keys(nanobind::handle keys);

// The indices of the keys that another one equals, in any order. Zeros are no keys.
nanobind::object repeated_keys(nanobind::handle keys);

}  // namespace edgegrad
