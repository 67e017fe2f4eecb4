// Iteration over the lanes of packets, and sums of lanes.
#pragma once

#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

// The first lane of a mask, which must have one.
EG_INLINE int first_lane(Mask m) {
#if defined(__AVX512F__) && EDGEGRAD_WIDTH == 16
    return __builtin_ctz(_mm512_test_epi32_mask((__m512i)m, (__m512i)m));
#else
    int lane = 0;
    while (!m[lane]) ++lane;
    return lane;
#endif
}

// The lanes of a mask as bits.
EG_INLINE uint32_t lane_bits(Mask m) {
#if defined(__AVX512F__) && EDGEGRAD_WIDTH == 16
    return _mm512_test_epi32_mask((__m512i)m, (__m512i)m);
#else
    uint32_t lanes = 0;
    for (int i = 0; i < W; ++i) lanes |= static_cast<uint32_t>(m[i] & 1) << i;
    return lanes;
#endif
}

// Loads 2 W consecutive numbers as W pairs.
EG_INLINE void load_pairs(const int32_t* p, Int& first, Int& second) {
#if EDGEGRAD_WIDTH == 16 && defined(__AVX512F__)
    const Int a = load(p), b = load(p + W);
    first = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    second = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
#else
    for (int i = 0; i < W; ++i) first[i] = p[2 * i], second[i] = p[2 * i + 1];
#endif
}

// Sum of all lanes in double precision, by pairwise halving.
EG_INLINE double sum_of_lanes(Float a) {
#if EDGEGRAD_WIDTH == 16 && defined(__AVX512F__)
    typedef double Eight __attribute__((vector_size(64)));
    const Eight low = __builtin_convertvector(__builtin_shufflevector(a, a, 0, 1, 2, 3, 4, 5, 6, 7), Eight);
    const Eight high =
        __builtin_convertvector(__builtin_shufflevector(a, a, 8, 9, 10, 11, 12, 13, 14, 15), Eight);
    const Eight eight = low + high;
    const auto four =
        __builtin_shufflevector(eight, eight, 0, 1, 2, 3) + __builtin_shufflevector(eight, eight, 4, 5, 6, 7);
    return (four[0] + four[2]) + (four[1] + four[3]);
#else
    double sum[W];
    for (int i = 0; i < W; ++i) sum[i] = static_cast<double>(a[i]);
    for (int half = W / 2; half > 0; half /= 2)
        for (int i = 0; i < half; ++i) sum[i] += sum[i + half];
    return sum[0];
#endif
}

}  // namespace edgegrad::EDGEGRAD_ISA
