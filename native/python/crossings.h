// Binding of the search for faces that pass through each other.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

// The pairs of faces of one mesh that share a line, (n, 2) (boundary/meshes/crossing_faces.h).
nanobind::object crossing_face_pairs(nanobind::handle vertices, nanobind::handle faces, int threads);

}  // namespace edgegrad
