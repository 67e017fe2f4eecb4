// A layer of fibres: Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly
// Transformed Cosines". The transform's coefficients and the albedo are MaterialX's closed-form fits to the
// paper's tables (Cycles reads the tables).
#pragma once

#include "sampling/hemisphere.h"
#include "shading/bsdf/fresnel.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Sheen {
    Vec3 weight;  // albedo included
    Vec3 x, y;    // x: the viewer's direction along the surface
    Float a, b;   // w' = (a x + b z, a y, z) is distributed by its cosine
};

EG_INLINE Float sheen_albedo(Float cosine, Float r) {
    const Float s = r * (0.0206607f + 1.58491f * r) / (0.0379424f + r * (1.32227f + r));
    const Float m =
        r * (-0.193854f + r * (-1.14885f + r * (1.7932f - 0.95943f * r * r))) / (0.046391f + r);
    const Float o =
        r * (0.000654023f + (-0.0207818f + 0.119681f * r) * r) / (1.26264f + r * (-1.92021f + r));
    const Float t = (cosine - m) / s;
    return saturate(exp(-0.5f * t * t) / (s * 2.50662827f) + o);
}

EG_INLINE Sheen make_sheen(Vec3 n, Vec3 wo, Float cosine, Float roughness) {
    const Float c = saturate(cosine), r = clamp(roughness, splat(1e-2f), splat(1.0f));
    Sheen s;
    s.a = max((2.58126f * c + 0.813703f * r) * r / (1.0f + 0.310327f * c * c + 2.60994f * c * r), 1e-4f);
    s.b = sqrt(1.0f - c) * (r - 1.0f) * r * r * r /
          (0.0000254053f + 1.71228f * c - 1.71506f * c * r + 1.34174f * r * r);
    const Vec3 along = wo - n * dot(n, wo);
    const Float length2 = dot(along, along);
    Vec3 unused;
    basis(n, s.x, unused);
    s.x = select(length2 > 1e-12f, along * (1.0f / sqrt(max(length2, 1e-12f))), s.x);
    s.y = cross(n, s.x);
    s.weight = splat3(sheen_albedo(c, r));
    return s;
}

// Density of directions; times `weight` it is f cos.
EG_INLINE Float sheen_density(const Sheen& s, Vec3 n, Vec3 wi) {
    const Float z = dot(n, wi), x = s.a * dot(s.x, wi) + s.b * z, y = s.a * dot(s.y, wi);
    const Float ratio = s.a / max(x * x + y * y + z * z, 1e-20f);
    return max(z, 0.0f) * ratio * ratio * kInvPi;
}

EG_INLINE Vec3 sample_sheen(const Sheen& s, Vec3 n, Float u, Float v) {
    Float sine, cosine;
    sincos_turn(v, sine, cosine);
    const Float r = sqrt(u), z = sqrt(max(1.0f - u, 1e-7f));
    const Vec3 w = s.x * ((r * cosine - s.b * z) / s.a) + s.y * (r * sine / s.a) + n * z;
    return w * (1.0f / sqrt(dot(w, w)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
