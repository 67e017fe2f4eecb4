// Directions in the hemisphere about n, and at an angle to n.
#pragma once

#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

constexpr float kInvPi = 0.318309886f;

// Samples in proportion to the cosine with n.
EG_INLINE Vec3 cosine_direction(Vec3 n, Float u, Float v) {
    Vec3 a, b;
    basis(n, a, b);
    Float s, c;
    sincos_turn(v, s, c);
    const Float sine = sqrt(u), cosine = sqrt(max(1.0f - u, 0.0f));
    return a * (sine * c) + b * (sine * s) + n * cosine;
}

// Samples uniformly.
constexpr float kUniformDensity = 0.159154943f;
EG_INLINE Vec3 uniform_direction(Vec3 n, Float u, Float v) {
    Vec3 a, b;
    basis(n, a, b);
    Float s, c;
    sincos_turn(v, s, c);
    const Float cosine = 1.0f - u, sine = sqrt(max(u * (2.0f - u), 0.0f));
    return a * (sine * c) + b * (sine * s) + n * cosine;
}

// The direction at an angle of the given cosine to n, turned about n by v.
EG_INLINE Vec3 direction_at(Vec3 n, Float cosine, Float v) {
    Vec3 a, b;
    basis(n, a, b);
    Float s, c;
    sincos_turn(v, s, c);
    const Float sine = sqrt(max(1.0f - cosine * cosine, 0.0f));
    return a * (sine * c) + b * (sine * s) + n * cosine;
}

// Samples half of the directions in proportion to the cosine, half uniformly.
EG_INLINE Vec3 mixed_direction(Vec3 n, Float u, Float v) {
    const Mask uniform = u < 0.5f;
    const Float height = max(select(uniform, 1.0f - 2.0f * u, 2.0f - 2.0f * u), 0.0f);
    return direction_at(n, select(uniform, height, sqrt(height)), v);
}

}  // namespace edgegrad::EDGEGRAD_ISA
