// Hashes of numbers and cells to numbers in [0, 1], with the results of Blender's textures (util/hash.h in
// Cycles): Jenkins' lookup3 on the bits of floats, and PCG on the indices of cells (Jarzynski and Olano 2020,
// "Hash Functions for GPU Rendering").
#pragma once

#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

// Works on packets, and on scalars at compile time.
template <typename U>
constexpr U rotated(U x, int k) {
    return (x << k) | (x >> (32 - k));
}

template <typename U>
constexpr void jenkins_final(U& a, U& b, U& c) {
    c = (c ^ b) - rotated(b, 14);
    a = (a ^ c) - rotated(c, 11);
    b = (b ^ a) - rotated(a, 25);
    c = (c ^ b) - rotated(b, 16);
    a = (a ^ c) - rotated(c, 4);
    b = (b ^ a) - rotated(a, 14);
    c = (c ^ b) - rotated(b, 24);
}

// Hash of the first N of x, y, z, w.
template <int N, typename U>
constexpr U jenkins(U x, U y, U z, U w) {
    U a = U{} + (0xdeadbeefu + (static_cast<uint32_t>(N) << 2) + 13u);
    U b = a, c = a;
    a += x;
    if (N >= 2) b += y;
    if (N >= 3) c += z;
    if (N == 4) {
        a = (a - c) ^ rotated(c, 4), c += b;
        b = (b - a) ^ rotated(a, 6), a += c;
        c = (c - b) ^ rotated(b, 8), b += a;
        a = (a - c) ^ rotated(c, 16), c += b;
        b = (b - a) ^ rotated(a, 19), a += c;
        c = (c - b) ^ rotated(b, 4), b += a;
        a += w;
    }
    jenkins_final(a, b, c);
    return c;
}

EG_INLINE Float hash_to_unit(UInt h) { return to_float(h) * (1.0f / 4294967296.0f); }

EG_INLINE Float hash1(Float x) { return hash_to_unit(jenkins<1>(float_bits(x), UInt{}, UInt{}, UInt{})); }
EG_INLINE Float hash2(Float x, Float y) {
    return hash_to_unit(jenkins<2>(float_bits(x), float_bits(y), UInt{}, UInt{}));
}
EG_INLINE Float hash3(Float x, Float y, Float z) {
    return hash_to_unit(jenkins<3>(float_bits(x), float_bits(y), float_bits(z), UInt{}));
}
EG_INLINE Float hash4(Float x, Float y, Float z, Float w) {
    return hash_to_unit(jenkins<4>(float_bits(x), float_bits(y), float_bits(z), float_bits(w)));
}

// PCG of N = 2, 3 or 4 indices, which gives as many numbers in [0, 1].
template <int N>
EG_INLINE void hash_cell(const UInt (&cell)[N], Float (&out)[N]) {
    UInt v[N];
    for (int k = 0; k < N; ++k) v[k] = cell[k] * 1664525u + 1013904223u;
    for (int round = 0; round < 2; ++round) {
        if (round == 1)  // Cycles shifts signed numbers here
            for (int k = 0; k < N; ++k) v[k] ^= bits(bits(v[k]) >> 16);
        if constexpr (N == 2) {
            v[0] += v[1] * 1664525u;
            v[1] += v[0] * 1664525u;
        } else if constexpr (N == 3) {
            v[0] += v[1] * v[2];
            v[1] += v[2] * v[0];
            v[2] += v[0] * v[1];
        } else {
            v[0] += v[1] * v[3];
            v[1] += v[2] * v[0];
            v[2] += v[0] * v[1];
            v[3] += v[1] * v[2];
        }
    }
    for (int k = 0; k < N; ++k) out[k] = to_float(bits(v[k] & 0x7fffffffu)) * (1.0f / 2147483648.0f);
}

}  // namespace edgegrad::EDGEGRAD_ISA
