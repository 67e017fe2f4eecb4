// Rough diffuse surfaces: Fujii's improved Oren-Nayar model with the multiple-scattering energy of OpenPBR,
// and the retro-reflection of Burley 2012. Both are factors on albedo / pi.
#pragma once

#include "shading/bsdf/fresnel.h"

namespace edgegrad::EDGEGRAD_ISA {

constexpr float kPi = 3.14159265f;

struct OrenNayar {
    Float a, b;     // times pi; b 0: Lambertian, a 1
    Vec3 repeated;  // the view's part of the multiple-scattering factor
};

// Directional albedo of the b term, over pi.
EG_INLINE Float oren_nayar_g(Float cosine) {
    const Float c = max(cosine, 1e-6f);
    const Float s = sqrt(max(1.0f - c * c, 0.0f));
    const Float g = s * (acos(c) - 2.0f / 3 - s * c) + (2.0f / 3) * (s / c) * (1.0f - s * s * s);
    return select(cosine < 1e-3f, (0.5f * kPi - 2.0f / 3) - cosine, g) * (1.0f / kPi);
}

EG_INLINE OrenNayar make_oren_nayar(Float sigma, Vec3 color, Float cosine) {
    OrenNayar o;
    o.a = kPi / (kPi + sigma * (0.5f * kPi - 2.0f / 3));
    o.b = sigma * o.a;
    const Vec3 albedo = saturate(color);
    const Float mean = o.a + ((2.0f * kPi - 5.6f) / (3.0f * kPi)) * o.b;
    const Float lost = 1.0f - mean;
    const Float toward = o.a + o.b * oren_nayar_g(max(cosine, 0.0f));
    o.repeated =
        divide(albedo * albedo * (mean / max(lost, 1e-6f) * (1.0f - toward)), white() - albedo * lost);
    o.repeated = select(sigma > 0.0f, o.repeated, zero3());
    return o;
}

EG_INLINE Vec3 oren_nayar(const OrenNayar& o, Float cos_o, Float cos_i, Float cos_between) {
    const Float nv = max(cos_o, 0.0f);
    Float t = cos_between - cos_i * nv;
    t = select(t > 0.0f, t / max(max(cos_i, nv), 1e-20f), t);
    const Float lost = 1.0f - (o.a + o.b * oren_nayar_g(cos_i));
    return splat3(o.a + o.b * t) + o.repeated * lost;
}

// Burley's diffuse factor. `cos_half` is the cosine of either direction with the half vector.
EG_INLINE Float burley(Float roughness, Float cos_o, Float cos_i, Float cos_half) {
    const Float fo = pow5(saturate(1.0f - cos_o)), fi = pow5(saturate(1.0f - cos_i));
    const Float r = 2.0f * roughness * cos_half * cos_half;
    return (1.0f - 0.5f * fi) * (1.0f - 0.5f * fo) + r * (fo + fi + fo * fi * (r - 1.0f));
}

}  // namespace edgegrad::EDGEGRAD_ISA
