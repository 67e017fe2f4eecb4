// Directions of the hemisphere in proportion to the cosine with n.
#pragma once

#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

constexpr float kInvPi = 0.318309886f;

EG_INLINE Vec3 cosine_direction(Vec3 n, Float u, Float v) {
    Vec3 a, b;
    basis(n, a, b);
    Float s, c;
    sincos_turn(v, s, c);
    const Float sine = sqrt(u), cosine = sqrt(max(1.0f - u, 0.0f));
    return a * (sine * c) + b * (sine * s) + n * cosine;
}

}  // namespace edgegrad::EDGEGRAD_ISA
