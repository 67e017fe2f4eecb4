// Velvet: the inverted Gaussian of Ashikhmin, Premoze and Shirley 2000 with the masking of V-grooves, as
// Cycles computes it:
//   f cos = D G / (4 n.v),  D = exp(-cot^2(h) / sigma^2) / (pi sigma^2 sin^4(h)).
// Samples are uniform over the hemisphere.
#pragma once

#include "shading/bsdf/fresnel.h"
#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

constexpr float kLeastVelvetSigma = 0.01f;

// f cos of a white surface. `cosine` is n.v.
EG_OUTLINE Float velvet_value(Float sigma, Vec3 n, Vec3 view, Float cosine, Vec3 w) {
    const Float out = dot(n, w);
    const Vec3 sum = view + w;
    const Vec3 h = sum * (1.0f / max(sqrt(dot(sum, sum)), 1e-20f));
    const Float nh = dot(n, h), hv = max(abs(dot(view, h)), 1e-5f);
    // Near the normal the exponential is 0, for every sigma up to 1.
    const Float cos2 = nh * nh, sin2 = max(1.0f - cos2, 5e-3f);
    const Float inverse = 1.0f / (sigma * sigma);
    const Float density = exp(-(cos2 / sin2) * inverse) * inverse * 0.318309886f / (sin2 * sin2);
    const Float masking = min(2.0f * abs(nh) / hv * min(cosine, out), splat(1.0f));
    return select((cosine > 0.0f) & (out > 0.0f), 0.25f * density * masking / max(cosine, 1e-6f), 0.0f);
}

}  // namespace edgegrad::EDGEGRAD_ISA
