// Samples of a derivative that are left out because they are not finite.
#pragma once

#include <cstdint>

namespace edgegrad {

// Samples of a derivative that are left out because they have no finite value: how many, and the first.
struct DroppedSamples {
    int64_t count = 0, first = INT64_MAX;
    int32_t place = -1, instance = -1;  // of the first: its edge, or (interior) face
};

}  // namespace edgegrad
