// The normal of lobes that are not diffuse. It is the shading normal, bent towards the geometric one until
// the mirror direction is not below the triangle (as in Cycles). It jumps where a normal that points away
// from the viewer and below the triangle begins to need bending (derivations, P).
#pragma once

#include "shading/bsdf/fresnel.h"

namespace edgegrad::EDGEGRAD_ISA {

// n, ng and wo are unit vectors with ng.wo > 0.
EG_INLINE Vec3 valid_mirror_normal(Vec3 n, Vec3 ng, Vec3 wo) {
    const Float up = dot(ng, wo);
    const Vec3 mirrored = n * (2.0f * dot(n, wo)) - wo;
    const Float least = min(0.9f * up, splat(0.01f));
    const Mask wrong = dot(ng, mirrored) < least;
    if (!any(wrong)) return n;
    // In the plane of ng and n, with x along the part of n across ng: n' = (sqrt(1 - q), sqrt(q)) reflects wo
    // to the height `least` for a root q of a quadratic equation, whose discriminant is
    // 4 side^2 (a - least^2). Its square root without the sign of `side` has no derivative at side = 0.
    const Vec3 across = n - ng * dot(n, ng);
    const Float length = sqrt(max(dot(across, across), 1e-30f));
    const Vec3 x = across * (1.0f / length);
    const Float side = dot(wo, x);
    const Float a = max(side * side + up * up, 1e-20f);
    const Float root = side * sqrt(max(a - least * least, 1e-30f));
    const Float q = saturate(0.5f * (a + up * least - root) / a);
    const Vec3 turned = x * sqrt(1.0f - q) + ng * sqrt(q);
    return select(wrong & (length > 1e-8f), turned, n);
}

}  // namespace edgegrad::EDGEGRAD_ISA
