// Fresnel reflectance of smooth interfaces.
#pragma once

#include "simd/elementary.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Vec3 splat3(Float s) { return {s, s, s}; }
EG_INLINE Vec3 white() { return splat3(splat(1.0f)); }
EG_INLINE Vec3 saturate(Vec3 v) { return {saturate(v.x), saturate(v.y), saturate(v.z)}; }
EG_INLINE Float average(Vec3 v) { return (v.x + v.y + v.z) * (1.0f / 3); }
EG_INLINE Vec3 divide(Vec3 a, Vec3 b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
EG_INLINE Vec3 mix(Vec3 a, Vec3 b, Float t) {
    return {lerp(a.x, b.x, t), lerp(a.y, b.y, t), lerp(a.z, b.z, t)};
}
EG_INLINE Float pow5(Float x) { return x * x * x * x * x; }

// Amplitudes of both polarisations that a dielectric with the relative index eta reflects, for light at the
// cosine c >= 0 on its outside.
struct Amplitudes {
    Mask refracts;    // false beyond the critical angle
    Float refracted;  // eta cos(theta_t), by Snell's law
    Float s, p;
};

EG_INLINE Amplitudes amplitudes(Float c, Float eta) {
    const Float squared = eta * eta - (1.0f - c * c);
    const Float g = sqrt(max(squared, 0.0f));
    // For equal indices both sums are 0 at grazing angles. The inverse square of kLeast is finite.
    constexpr float kLeast = 1e-15f;
    const Float eta2c = eta * eta * c;
    return {squared > 0.0f, g, (c - g) / max(c + g, kLeast), (eta2c - g) / max(eta2c + g, kLeast)};
}

// Unpolarised Fresnel reflectance of a dielectric with the relative index eta, for light at the given cosine
// on its outside, and the cosine of the refracted direction. 1 and 0 beyond the critical angle.
struct Dielectric {
    Float reflectance, cosine;
};

EG_INLINE Dielectric dielectric(Float cosine, Float eta) {
    const Amplitudes a = amplitudes(abs(cosine), eta);
    return {select(a.refracts, 0.5f * (a.s * a.s + a.p * a.p), 1.0f),
            select(a.refracts, a.refracted / eta, 0.0f)};
}

// Negative derivative of the reflectance (s^2 + p^2) / 2 by the cosine c, where light refracts: g = eta
// cos(theta_t), whose derivative is c/g. Works on raw packets too (adjoint/number.h).
template <typename F>
EG_INLINE F reflectance_fall(F c, F eta, F g, F inverse_g) {
    const F e = eta * eta * c, steep = g - c * c * inverse_g;
    const F s = 1.0f / (c + g), p = 1.0f / (e + g);
    return -2.0f * steep * ((c - g) * s * s * s + (e - g) * eta * eta * p * p * p);
}

// Reflectance at normal incidence, and its inverse for indices above 1.
EG_INLINE Float f0_of_ior(Float eta) {
    const Float r = (eta - 1.0f) / (eta + 1.0f);
    return r * r;
}
EG_INLINE Float ior_of_f0(Float f0) {
    const Float r = sqrt(clamp(f0, splat(0.0f), splat(0.99f)));
    return (1.0f + r) / (1.0f - r);
}

// Position of the reflectance between normal incidence (0) and grazing angles (1). Cycles interpolates
// between f0 and f90 by it.
EG_INLINE Float fresnel_share(Float reflectance, Float f0) {
    return saturate((reflectance - f0) / max(1.0f - f0, 1e-6f));
}

// Cosine-weighted mean of a dielectric's reflectance (fit by Kulla and Conty 2017).
EG_INLINE Float mean_dielectric(Float eta) {
    return select(eta < 1.0f, 0.997118f + eta * (0.1014f - eta * (0.965241f + eta * 0.130607f)),
                  (eta - 1.0f) / (4.08567f + 1.00071f * eta));
}

// F82-tint (Kutz et al. 2021, "Novel aspects of the Adobe Standard Material"): Schlick's curve minus b c (1 -
// c)^6, so that it is multiplied by the tint at c = 1/7.
EG_INLINE Vec3 f82_b(Vec3 f0, Vec3 tint) {
    constexpr float k = 6.0f / 7, k5 = k * k * k * k * k;
    return mix(f0, white(), splat(k5)) * (white() - tint) * splat(7.0f / (k5 * k));
}
EG_INLINE Vec3 f82(Float cosine, Vec3 f0, Vec3 b) {
    const Float s = saturate(1.0f - cosine);
    const Float s5 = pow5(s);
    return saturate(mix(f0, white(), s5) - b * (cosine * s5 * s));
}
EG_INLINE Vec3 mean_f82(Vec3 f0, Vec3 b) {
    return mix(f0, white(), splat(1.0f / 21)) - b * splat(1.0f / 126);
}

}  // namespace edgegrad::EDGEGRAD_ISA
