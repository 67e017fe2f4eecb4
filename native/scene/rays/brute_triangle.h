// A triangle, prepared for tests against every ray (scene/rays/brute_force.h).
#pragma once

#include <cstdint>

namespace edgegrad {

// Largest number of triangles to prepare. Kernels decide by their packets' width (scene/rays/rays.h).
constexpr int32_t kBruteForceFaces = 96;

struct BruteTriangle {
    // Pluecker coordinates of the edges p1 p2, p2 p0 and p0 p1: a x b and b - a of the edge from a to b. The
    // reversed edge has exactly the negative coordinates.
    float edge[3][6];
    float normal[3], offset;  // normal . p = offset on the plane, normal = (p1 - p0) x (p2 - p0)
    int32_t face, mesh, mask;
};

}  // namespace edgegrad
