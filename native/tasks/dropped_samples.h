// Samples that are left out because they are not finite.
#pragma once

#include <cstdint>

namespace edgegrad {

// Samples of a derivative, or light of a picture's paths, that are left out because they have no finite
// value: how many, and the first.
struct DroppedSamples {
    int64_t count = 0, first = INT64_MAX;
    int32_t place = -1, instance = -1;  // of the first: its edge, or (interior) face

    // Counts one; the first has the smallest number `at`.
    void add(int64_t at, int32_t of_place = -1, int32_t of_instance = -1) {
        ++count;
        if (at < first) first = at, place = of_place, instance = of_instance;
    }
};

}  // namespace edgegrad
