// Faces that the camera sees nearly edge-on, and camera samples by their area (path/edge_on.h).
#pragma once

#include "tasks/image_task.h"

namespace edgegrad {

// The expected number of samples by area per square metre of such a face, and that of camera samples per
// pixel.
struct EdgeOnFaces {
    const int32_t* first;     // (F + 1) where each face's entries begin, one for each of its copies
    const int32_t* instance;  // by entry, ascending for each face; -1: the face stands in the world itself
    const float* density;     // by entry
    float samples;
};

// Samples [first, first + count) of `total` systematic ones over the summed weight of the
// triangles that are the parts of such faces in the frame.
struct EdgeOnTask {
    EdgeOnFaces faces;
    const int32_t *face, *instance;  // by triangle
    const float* corners;            // (pieces, 9), in the world
    const double* cumulative;        // (pieces + 1) weight
    int64_t pieces;
    int64_t first, count, total;
    ImageTask paths;  // a sample is a path of it
    // Gradients: the picture's adjoint, and where a sample's is written (count, 3); null: forward mode.
    const float* adjoint;
    float* seen_adjoint;
};

}  // namespace edgegrad
