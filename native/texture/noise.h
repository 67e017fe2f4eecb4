// Perlin noise and its fractal sums (Cycles' noise.h, fractal_noise.h and noisetex.h), in N = 1 to 4
// dimensions. Lanes may differ in every parameter.
#pragma once

#include "simd/elementary.h"
#include "texture/hash.h"

namespace edgegrad::EDGEGRAD_ISA {

template <int N>
struct NoisePoint {
    Float x[N];
};

template <int N>
EG_INLINE NoisePoint<N> operator*(NoisePoint<N> p, Float s) {
    for (int k = 0; k < N; ++k) p.x[k] *= s;
    return p;
}

EG_INLINE Float fade(Float t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); }
EG_INLINE Float negate_if(Float a, UInt condition) { return select(condition != 0u, -a, a); }

// Dot product of the offset f and the gradient that a corner's hash selects.
template <int N>
EG_INLINE Float corner_slope(UInt hash, const Float (&f)[N]) {
    if constexpr (N == 1) {
        const UInt h = hash & 15u;
        return negate_if((1.0f + to_float(bits(h & 7u))) * f[0], h & 8u);
    } else if constexpr (N == 2) {
        const UInt h = hash & 7u;
        const Mask first = h < 4u;
        return negate_if(select(first, f[0], f[1]), h & 1u) +
               negate_if(2.0f * select(first, f[1], f[0]), h & 2u);
    } else if constexpr (N == 3) {
        const UInt h = hash & 15u;
        const Float other = select((h == 12u) | (h == 14u), f[0], f[2]);
        return negate_if(select(h < 8u, f[0], f[1]), h & 1u) + negate_if(select(h < 4u, f[1], other), h & 2u);
    } else {
        const UInt h = hash & 31u;
        return negate_if(select(h < 24u, f[0], f[1]), h & 1u) +
               negate_if(select(h < 16u, f[1], f[2]), h & 2u) + negate_if(select(h < 8u, f[2], f[3]), h & 4u);
    }
}

// Interpolates between the 2^K corners that differ in the first K axes. `cell` and `f` give the other axes.
template <int N, int K>
EG_INLINE Float perlin_corners(UInt (&cell)[N], Float (&f)[N], const Float (&u)[N]) {
    if constexpr (K == 0) {
        const UInt zero{};
        const UInt h = jenkins<N>(cell[0], N > 1 ? cell[N > 1 ? 1 : 0] : zero,
                                  N > 2 ? cell[N > 2 ? 2 : 0] : zero, N > 3 ? cell[N > 3 ? 3 : 0] : zero);
        return corner_slope<N>(h, f);
    } else {
        const Float low = perlin_corners<N, K - 1>(cell, f, u);
        cell[K - 1] += 1u;
        f[K - 1] -= 1.0f;
        const Float high = perlin_corners<N, K - 1>(cell, f, u);
        cell[K - 1] -= 1u;
        f[K - 1] += 1.0f;
        return low + u[K - 1] * (high - low);
    }
}

// Signed noise in about [-1, 1].
template <int N>
EG_INLINE Float signed_noise(NoisePoint<N> p) {
    constexpr float kScale[4] = {0.25f, 0.6616f, 0.982f, 0.8344f};
    UInt cell[N];
    Float f[N], u[N];
    for (int k = 0; k < N; ++k) {
        // The noise repeats far from the origin; where floats have no fraction it would be constant
        // otherwise.
        const Mask far = abs(p.x[k]) >= 100000.0f;
        Float x = p.x[k];
        if (any(far)) {
            const Float shift = select(abs(x) >= 1000000.0f, splat(0.5f), 0.0f);
            x = fmod(x, splat(100000.0f)) + shift;
        }
        const Float whole = floor(x);
        cell[k] = bits(to_int(whole));
        f[k] = x - whole;
        u[k] = fade(f[k]);
    }
    return kScale[N - 1] * perlin_corners<N, N>(cell, f, u);
}

struct NoiseShape {
    Float detail, roughness, lacunarity, offset, gain;
    bool normalize;
};

enum NoiseKind : int32_t { kFbm, kMultifractal, kRidged, kHybrid, kHetero };

// Calls octave(k, weight) with the weight of octave k in each lane: 1 below its detail, the fraction of the
// last octave (if `partial`), and 0 after that.
template <typename Octave>
EG_INLINE void for_octaves(Float detail, bool partial, Octave octave) {
    const Float whole = floor(detail);
    for (int k = 0; k <= 16; ++k) {
        const Mask inside = whole >= static_cast<float>(k);
        const Mask last = whole == static_cast<float>(k - 1);
        Float share = select(inside, splat(1.0f), 0.0f);
        if (partial) share = select(last, detail - whole, share);
        if (!any(share > 0.0f)) break;
        octave(k, share);
    }
}

template <int N>
EG_INLINE Float fbm(NoisePoint<N> p, const NoiseShape& s) {
    Float scale = splat(1.0f), amplitude = splat(1.0f), largest = splat(0.0f), sum = splat(0.0f);
    Float result = splat(0.0f);
    for_octaves(s.detail, true, [&](int k, Float share) EG_INLINE_LAMBDA {
        const Float t = signed_noise<N>(p * scale);
        const Float more = sum + t * amplitude, more_largest = largest + amplitude;
        const Mask full = share == 1.0f;
        if (s.normalize) {
            const Float before = k == 0 ? splat(0.5f) : 0.5f * sum / largest + 0.5f;
            const Float after = 0.5f * more / more_largest + 0.5f;
            result = select(share > 0.0f, before + share * (after - before), result);
        } else {
            result = select(share > 0.0f, sum + share * (more - sum), result);
        }
        sum = select(full, more, sum);
        largest = select(full, more_largest, largest);
        amplitude *= s.roughness;
        scale *= s.lacunarity;
    });
    return result;
}

template <int N>
EG_INLINE Float multifractal(NoisePoint<N> p, const NoiseShape& s) {
    Float value = splat(1.0f), power = splat(1.0f);
    for_octaves(s.detail, true, [&](int, Float share) EG_INLINE_LAMBDA {
        value *= share * power * signed_noise<N>(p) + 1.0f;
        power *= s.roughness;
        p = p * s.lacunarity;
    });
    return value;
}

template <int N>
EG_INLINE Float hetero_terrain(NoisePoint<N> p, const NoiseShape& s) {
    Float value = splat(0.0f), power = splat(1.0f);
    for_octaves(s.detail, true, [&](int k, Float share) EG_INLINE_LAMBDA {
        const Float t = signed_noise<N>(p) + s.offset;
        value = k == 0 ? t : value + share * (t * power * value);
        power *= s.roughness;
        p = p * s.lacunarity;
    });
    return value;
}

template <int N>
EG_INLINE Float hybrid_multifractal(NoisePoint<N> p, const NoiseShape& s) {
    Float value = splat(0.0f), power = splat(1.0f), weight = splat(1.0f);
    Mask alive = splat(-1);
    for_octaves(s.detail, true, [&](int, Float share) EG_INLINE_LAMBDA {
        alive = alive & (weight > 0.001f);
        weight = min(weight, splat(1.0f));
        const Float signal = (signed_noise<N>(p) + s.offset) * power;
        value = select(alive, value + share * weight * signal, value);
        power *= s.roughness;
        weight *= s.gain * signal;
        p = p * s.lacunarity;
    });
    return value;
}

template <int N>
EG_INLINE Float ridged_multifractal(NoisePoint<N> p, const NoiseShape& s) {
    Float value = splat(0.0f), power = splat(1.0f), signal = splat(0.0f);
    for_octaves(s.detail, false, [&](int k, Float share) EG_INLINE_LAMBDA {
        const Float weight = k == 0 ? splat(1.0f) : saturate(signal * s.gain);
        const Float ridge = s.offset - abs(signed_noise<N>(p));
        signal = ridge * ridge * weight;
        value += share * signal * power;
        power *= s.roughness;
        p = p * s.lacunarity;
    });
    return value;
}

template <int N>
EG_INLINE Float fractal_noise(int32_t kind, NoisePoint<N> p, const NoiseShape& s) {
    switch (kind) {
        case kMultifractal:
            return multifractal<N>(p, s);
        case kRidged:
            return ridged_multifractal<N>(p, s);
        case kHybrid:
            return hybrid_multifractal<N>(p, s);
        case kHetero:
            return hetero_terrain<N>(p, s);
        default:
            return fbm<N>(p, s);
    }
}

// Component k of a large offset, which acts as another seed.
template <int N>
constexpr float noise_offset(int seed, int k) {
    const uint32_t s = __builtin_bit_cast(uint32_t, static_cast<float>(seed));
    const uint32_t t = __builtin_bit_cast(uint32_t, static_cast<float>(k));
    const uint32_t h = N == 1 ? jenkins<1, uint32_t>(s, 0, 0, 0) : jenkins<2, uint32_t>(s, t, 0, 0);
    return 100.0f + static_cast<float>(h) * (1.0f / 4294967296.0f) * 100.0f;
}

template <int N>
EG_INLINE NoisePoint<N> moved(NoisePoint<N> p, int seed) {
    for (int k = 0; k < N; ++k) p.x[k] += noise_offset<N>(seed, k);
    return p;
}

// Blender's Noise Texture. The second and third value complete its colour.
template <int N>
static __attribute__((noinline)) void noise_texture(int32_t kind, NoisePoint<N> p, NoiseShape s,
                                                    Float distortion, bool color, Float* out) {
    if (any(distortion != 0.0f)) {
        NoisePoint<N> q = p;
        for (int k = 0; k < N; ++k) q.x[k] += signed_noise<N>(moved<N>(p, k)) * distortion;
        p = q;
    }
    for (int k = 0; k < (color ? 3 : 1); ++k)
        out[k] = fractal_noise<N>(kind, k == 0 ? p : moved<N>(p, N + k - 1), s);
}

}  // namespace edgegrad::EDGEGRAD_ISA
