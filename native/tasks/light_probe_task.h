// Light sampling by itself, for tests: what kernels compute for a path's vertices, for arrays of points.
#pragma once

#include <cstdint>

#include "scene/view.h"

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

// Directions w from points: the density with which they are sampled where they meet the face at the distance
// r, and the light of the table's sized lights along them.
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

// Samples of the environment's image for (u, v), or, where those are null, its radiance and density along w.
struct EnvironmentProbes {
    int64_t count;
    const float *u, *v;
    float *w, *radiance;  // (count, 3)
    float* pdf;
};

}  // namespace edgegrad
