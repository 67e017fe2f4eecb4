// Faces that the camera sees nearly edge-on, and camera samples by their area (path/edge_on.h).
#pragma once

#include "tasks/image_task.h"

namespace edgegrad {

// By how many samples by area a square metre of such a face is expected to be met, and by how many of the
// camera a pixel.
struct EdgeOnFaces {
    const int32_t* first;     // (F + 1) where each face's entries begin, one for each of its copies
    const int32_t* instance;  // by entry, ascending for each face; -1: the face stands in the world itself
    const float* density;     // by entry
    float samples;
};

// Samples [first, first + count) of `total` systematic ones over the summed mass of pieces of such faces.
struct EdgeOnTask {
    EdgeOnFaces faces;
    const int32_t *face, *instance;  // by piece
    const float* corners;            // (pieces, 9), in the world
    const double* cumulative;        // (pieces + 1) mass
    int64_t pieces;
    int64_t first, count, total;
    ImageTask paths;  // a sample is a path of it
    // Gradients: the picture's adjoint, and where a sample's is written (count, 3); null: forward mode.
    const float* adjoint;
    float* seen_adjoint;
};

}  // namespace edgegrad
