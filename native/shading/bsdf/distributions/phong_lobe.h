// The anisotropic Phong reflection of Ashikhmin and Shirley 2000, without Fresnel factor, as Cycles computes
// it:
//   f cos = p(h) w.z / (4 (h.v) max(v.z, w.z)),
//   p(h) = sqrt((nx + 1) (ny + 1)) / (2 pi) h.z^e,  e = (nx h.x^2 + ny h.y^2) / (1 - h.z^2),
// with the exponents n = 2 / alpha^2 - 2. p is the density of half vectors; it does not depend on the view.
// Vectors are in the local frame, whose z is the shading normal.
#pragma once

#include "simd/elementary.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// Cycles' limits: smaller alphas are raised to this one; where both are not above it, the surface is a
// mirror.
constexpr float kLeastPhongAlpha = 1e-4f;

EG_INLINE Float phong_exponent(Float alpha) {
    const Float a = max(alpha, kLeastPhongAlpha);
    return 2.0f / (a * a) - 2.0f;
}

// p(h). h.z^e = exp((nx x^2 + ny y^2) log(z) / (x^2 + y^2)); the quotient is a series near the normal.
EG_INLINE Float phong_density(Float ax, Float ay, Vec3 h) {
    const Float nx = phong_exponent(ax), ny = phong_exponent(ay);
    const Float x2 = h.x * h.x, y2 = h.y * h.y, s2 = x2 + y2;
    const Mask steep = s2 > 1e-3f;
    const Float series = -0.5f - s2 * (0.25f + s2 * (1.0f / 6));
    const Float quotient = select(steep, log(max(h.z, 1e-6f)) / select(steep, s2, splat(1.0f)), series);
    return sqrt((nx + 1.0f) * (ny + 1.0f)) * exp((nx * x2 + ny * y2) * quotient) * 0.159154943f;
}

// The share of light of a half vector that masking leaves.
EG_INLINE Float phong_masking(Float view_z, Float light_z) {
    return light_z / max(max(view_z, light_z), 1e-6f);
}

// Samples p(h).
EG_OUTLINE Vec3 sample_phong(Float ax, Float ay, Float u, Float v) {
    const Float nx = phong_exponent(ax), ny = phong_exponent(ay);
    Float s, c;
    sincos_turn(v, s, c);
    const Float x = c * sqrt(ny + 1.0f), y = s * sqrt(nx + 1.0f), unit = 1.0f / sqrt(x * x + y * y);
    const Float cosine = x * unit, sine = y * unit;
    const Float e = nx * cosine * cosine + ny * sine * sine;
    // h.z^2 = exp(-t); 1 - exp(-t) is a series for narrow lobes.
    const Float t = -2.0f * log(max(1.0f - u, 1e-7f)) / (e + 1.0f);
    const Float z2 = exp(-t);
    const Float out = sqrt(select(t < 0.02f, t * (1.0f - t * (0.5f - t * (1.0f / 6))), 1.0f - z2));
    return {out * cosine, out * sine, sqrt(z2)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
