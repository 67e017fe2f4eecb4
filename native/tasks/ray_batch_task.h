// Rays to trace by themselves, for measurements.
#pragma once

#include <cstdint>

namespace edgegrad {

// Rays to trace by themselves, in columns of whole packets.
struct RayBatch {
    const float *origin[3], *direction[3], *far;
    int64_t count;
    bool shadow;  // whether something is hit, else the nearest hit
    bool coherent;
    bool brute_force;  // all triangles, whatever their number, else as pictures do
};

}  // namespace edgegrad
