// Pairs of faces of one mesh that pass through each other.
#pragma once

#include <cstdint>
#include <vector>

#include "boundary/meshes/trees/box_pairs.h"

namespace edgegrad {

// The pairs (a, b), a < b, of faces that share a line, sorted. Faces are three vertex numbers each; faces
// with two common vertices are left out, and so are faces that touch at vertices or edges only, and coplanar
// ones.
std::vector<BoxPair> crossing_faces(const double* vertices, const int32_t* faces, size_t face_count,
                                    int threads);

}  // namespace edgegrad
