// Systematic sampling from cumulative weights: sample k lies at a random position in the k-th of equal parts.
#pragma once

#include "sampling/sobol.h"

namespace edgegrad::EDGEGRAD_ISA {

// Position of sample k, in units of parts.
EG_INLINE double systematic_place(int64_t k, uint32_t seed) {
    const uint32_t random = hash(static_cast<uint32_t>(k) ^ hash(seed ^ 0x51ed270bu));
    return static_cast<double>(k) + static_cast<double>(random >> 8) * 5.9604645e-8;
}

// Index of the last entry of ascending cumulative weights that is not above `place`.
EG_INLINE int64_t last_below(const double* cumulative, int64_t count, double place) {
    int64_t low = 0, high = count;
    while (high - low > 1) {
        const int64_t mid = (low + high) / 2;
        (cumulative[mid] <= place ? low : high) = mid;
    }
    return low;
}

// The same for ascending positions, starting from the previous result.
EG_INLINE void go_to(const double* cumulative, int64_t count, double place, int64_t& at) {
    while (at + 1 < count && cumulative[at + 1] <= place) ++at;
}

}  // namespace edgegrad::EDGEGRAD_ISA
