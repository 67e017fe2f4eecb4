// Weighted sums of texels, read lane by lane, up to four consecutive floats at a time.
#pragma once

#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

// Four components; `Texel` is those of one lane.
struct Color4 {
    Float c[4];
};

#ifndef EDGEGRAD_TAPED
typedef float Texel __attribute__((vector_size(16)));

// Sum over k of weight[k] times the four floats at base + index[k], for each lane. Components after the first
// `components` are undefined.
template <int N>
EG_INLINE Color4 sum_texels(const float* base, const Rows (&index)[N], const Float (&weight)[N], int) {
    float share[N][W];
    for (int k = 0; k < N; ++k) store(share[k], weight[k]);
    Texel found[W];
    for (int lane = 0; lane < W; ++lane) {
        Texel sum{};
        for (int k = 0; k < N; ++k) {
            Texel t;
            __builtin_memcpy(&t, base + index[k][lane], sizeof t);
            sum += t * share[k][lane];
        }
        found[lane] = sum;
    }
    Color4 r;
    const float* p = reinterpret_cast<const float*>(found);
    for (int k = 0; k < 4; ++k)
        for (int i = 0; i < W; ++i) r.c[k][i] = p[4 * i + k];
    return r;
}
#else
// The same for numbers with derivatives, which are recorded by component.
template <int N>
EG_INLINE Color4 sum_texels(const float* base, const Rows (&index)[N], const Float (&weight)[N],
                            int components) {
    Color4 r{};
    for (int c = 0; c < components; ++c) {
        Float texel[N];
        for (int k = 0; k < N; ++k) texel[k] = gather(base + c, packet(index[k]));
        r.c[c] = sum_of_products(texel, weight);
    }
    return r;
}
#endif

}  // namespace edgegrad::EDGEGRAD_ISA
