// Counts of samples that are left out because their value is not finite.
#pragma once

#include <cstdint>

namespace edgegrad {

// The number of such samples of a derivative, or of paths of a picture, and the place of the first one.
struct DroppedSamples {
    int64_t count = 0, first = INT64_MAX;
    int32_t place = -1, instance = -1;  // of the first sample: its edge, or (interior) face

    // Counts one sample. The first sample is that of the smallest number `at`.
    void add(int64_t at, int32_t of_place = -1, int32_t of_instance = -1) {
        ++count;
        if (at < first) first = at, place = of_place, instance = of_instance;
    }
};

}  // namespace edgegrad
