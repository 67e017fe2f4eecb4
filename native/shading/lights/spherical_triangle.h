// Sampling of directions to a triangle, uniform in solid angle (Peters 2021, "BRDF Importance Sampling for
// Polygonal Lights", section 4). It forms no angles of the spherical triangle and is therefore accurate for
// small and for thin ones.
#pragma once

#include "scene/geometry.h"
#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

// A triangle seen from a point: unit directions to its corners, and the volume that determines its solid
// angle,
//   tan(solid_angle / 2) = volume / (1 + apex.first + first.last + apex.last).
struct SphericalTriangle {
    Vec3 apex, first, last;
    Float volume;  // |apex . (first x last)|
    Float solid_angle;
};

// The triangle with corners a, b, c relative to the point. |a . m| with m = (b - a) x (c - a) is six times
// the volume of the tetrahedron, without the cancellation of unit vectors.
EG_INLINE SphericalTriangle spherical_triangle(Vec3 a, Vec3 b, Vec3 c, Vec3 m) {
    const Float ra = 1.0f / max(sqrt(dot(a, a)), 1e-30f);
    const Float rb = 1.0f / max(sqrt(dot(b, b)), 1e-30f);
    const Float rc = 1.0f / max(sqrt(dot(c, c)), 1e-30f);
    SphericalTriangle s{a * ra, b * rb, c * rc, {}, {}};
    s.volume = abs(dot(a, m)) * (ra * rb * rc);
    s.solid_angle =
        2.0f * atan2(s.volume, 1.0f + dot(s.apex, s.first) + dot(s.first, s.last) + dot(s.apex, s.last));
    return s;
}

// Samples a direction. Moving `last` towards `first` cuts the part u of the solid angle off; v moves from the
// apex to the new side.
EG_INLINE Vec3 sample_triangle(const SphericalTriangle& s, Float u, Float v) {
    Float sine, cosine;
    // The angle is half of the part's solid angle, in turns.
    sincos_turn(min(u * s.solid_angle * 0.0795774715f, splat(0.49999997f)), sine, cosine);
    const Float along = 1.0f + dot(s.apex, s.first);
    const Float across = dot(s.apex, s.last) + dot(s.first, s.last);
    const Vec3 half = s.first * (s.volume * cosine - across * sine) + s.last * (along * sine);
    const Float length2 = dot(half, half);
    const Vec3 cut = half * (2.0f * dot(s.first, half) / max(length2, 1e-37f)) - s.first;
    // Uniform in the cosine to the apex. For small triangles 1 - cos is accurate, the cosine is not.
    const Vec3 chord = cut - s.apex;
    const Float rise_of_cut = 0.5f * dot(chord, chord), rise = v * rise_of_cut;
    const Vec3 toward = chord + s.apex * rise_of_cut;  // orthogonal to the apex
    const Float scale = sqrt(max(rise * (2.0f - rise), 0.0f) / max(dot(toward, toward), 1e-37f));
    return s.apex * (1.0f - rise) + toward * scale;
}

}  // namespace edgegrad::EDGEGRAD_ISA
