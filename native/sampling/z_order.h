// Positions in the picture along a Z-order curve (Morton 1966). Neighbours on the curve are near each other
// in the picture, so that systematic samples from a list in this order are well distributed.
#pragma once

#include <algorithm>
#include <cstdint>

namespace edgegrad {

// Inserts a zero after each of up to 8 bits of x, for a number or a packet.
template <typename Bits>
inline __attribute__((always_inline)) Bits spread_bits(Bits x) {
    x = (x | (x << 4)) & 0x0f0f0f0fu;
    x = (x | (x << 2)) & 0x33333333u;
    return (x | (x << 1)) & 0x55555555u;
}

// The tile of (x, y) among 2^bits x 2^bits tiles; x and y are from 0 to 1 over the picture. Points outside
// get the nearest tile.
inline uint32_t z_order(double x, double y, uint32_t bits) {
    const auto tile = [bits](double at) {
        return static_cast<uint32_t>((at > 0.0 ? std::min(at, 0.999) : 0.0) * (1u << bits));  // 0 of NaN
    };
    return spread_bits(tile(x)) | spread_bits(tile(y)) << 1;
}

}  // namespace edgegrad
