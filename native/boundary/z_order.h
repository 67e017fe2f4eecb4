// Places of the picture along a Z-order curve (Morton 1966): what is near on it is near in the picture, so
// that systematic samples along a list in its order are spread evenly.
#pragma once

#include <algorithm>
#include <cstdint>

namespace edgegrad {

// The tile of (x, y), both from 0 to 1 over the picture, of 2^bits x 2^bits; what is outside is at its
// border.
inline uint32_t z_order(double x, double y, uint32_t bits) {
    const auto tile = [bits](double at) {
        return static_cast<uint32_t>(std::clamp(at, 0.0, 0.999) * (1u << bits));
    };
    // Every bit of up to 8 is followed by a zero.
    const auto spread = [](uint32_t tile) {
        tile = (tile | tile << 4) & 0x0f0fu;
        tile = (tile | tile << 2) & 0x3333u;
        return (tile | tile << 1) & 0x5555u;
    };
    return spread(tile(x)) | spread(tile(y)) << 1;
}

}  // namespace edgegrad
