// Directions within a cone, uniform in solid angle: towards spheres and suns.
#pragma once

#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// The cone is given by `one_minus_cos` of half its opening angle, because the cosine of narrow cones is
// inaccurate.
EG_INLINE Vec3 sample_cone(Vec3 axis, Float one_minus_cos, Float u, Float v) {
    Vec3 a, b;
    basis(axis, a, b);
    const Float rise = u * one_minus_cos;
    const Float sine = sqrt(max(rise * (2.0f - rise), 0.0f));
    Float s, c;
    sincos_turn(v, s, c);
    return a * (sine * c) + b * (sine * s) + axis * (1.0f - rise);
}

// 1 - cos of a unit vector's angle to an axis, from its component z along the axis and the squared length
// across it. 1 - z would be inaccurate near the axis.
EG_INLINE Float rise_from_axis(Float across2, Float z) {
    return select(z > 0.5f, across2 / (1.0f + max(z, splat(0.5f))), 1.0f - z);
}

// Maps to a point of the unit disk by concentric squares (Shirley and Chiu 1997).
EG_INLINE void sample_disk(Float u, Float v, Float& x, Float& y) {
    const Float a = 2.0f * u - 1.0f, b = 2.0f * v - 1.0f;
    const Mask wide = abs(a) > abs(b);
    const Float radius = select(wide, a, b);
    const Float ratio = select(wide, b, a) / select(radius != 0.0f, radius, 1.0f);
    // Angle from the axis of the larger coordinate: pi/4 ratio, in turns 1/8 ratio.
    Float turn = select(wide, 0.125f * ratio, 0.25f - 0.125f * ratio);
    turn = select(turn < 0.0f, turn + 1.0f, turn);
    Float s, c;
    sincos_turn(turn, s, c);
    x = radius * c;
    y = radius * s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
