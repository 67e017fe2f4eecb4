// Faces that the camera sees nearly edge-on, and camera samples by their area (path/edge_on.h).
#pragma once

#include "tasks/image_task.h"

namespace edgegrad {

// Expected numbers of samples by area per square metre of such a face, and of camera samples per pixel.
struct EdgeOnFaces {
    const int32_t* first;     // (F + 1) start of each face's entries, one entry per instance
    const int32_t* instance;  // by entry, ascending for each face; -1: the face stands in the world itself
    const float* density;     // by entry
    float samples;
};

// Samples [first, first + count) of `total` systematic samples over the summed weight of triangles, which are
// the parts of such faces inside the frame.
struct EdgeOnTask {
    EdgeOnFaces faces;
    const int32_t *face, *instance;  // by triangle
    const float* corners;            // (pieces, 9), in the world
    const double* cumulative;        // (pieces + 1) weight
    int64_t pieces;
    int64_t first, count, total;
    ImageTask paths;  // each sample is one of its paths
    // Reverse mode: the picture's adjoint, and (count, 3) output for the adjoint of each sample. Null:
    // forward mode.
    const float* adjoint;
    float* seen_adjoint;
};

}  // namespace edgegrad
