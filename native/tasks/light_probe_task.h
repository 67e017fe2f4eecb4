// Tests of light sampling: the kernels' functions for vertices of paths, applied to arrays of points.
#pragma once

#include <cstdint>

namespace edgegrad {

// `count` points with normals and random numbers; results in arrays of the same length.
struct LightProbes {
    int64_t count;
    const float *position, *normal;  // (count, 3)
    const float *u, *v;
    int32_t both_sides;
    // Samples:
    float *w, *radiance;  // (count, 3); radiance 0: none
    float *r, *pdf, *geometry;
};

// Directions w from points. Output: the density with which light sampling returns w towards a face at the
// distance r, and the radiance of the table's sized lights along w.
struct DirectionProbes {
    int64_t count;
    const float *position, *normal, *w;
    const int32_t* face;  // -1: none
    const float* r;       // where the ray ends
    const float* bsdf_pdf;
    int32_t kind, both_sides;
    float* pdf;       // of the face
    float* radiance;  // (count, 3) of the sized lights
};

// Samples of the environment's image for (u, v). If u is null: the radiance and density along w.
struct EnvironmentProbes {
    int64_t count;
    const float *u, *v;
    float *w, *radiance;  // (count, 3)
    float* pdf;
};

}  // namespace edgegrad
