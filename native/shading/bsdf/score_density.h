// Sampling of GGX normals for the derivative by roughness (derivations, M).
//
// For a surface seen from above, the score d log D / d log(alpha) of a normal is 2 (2u - 1), where u is the
// random number that `sample_normal` maps to the normal's slope. It is negative in the middle of a lobe and
// positive around it. Pictures use uniform u. Here u has the density F + (1 - F) 2 |2u - 1|, which samples
// both signs in proportion to their contribution. The map to this density is monotone and so keeps samples
// well distributed. The uniform part F samples light whose own derivative the lobe only passes on.
#pragma once

#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

// The uniform part F: more of it lowers the variance of paths with several such lobes and raises that of a
// single lobe.
constexpr float kEvenShare = 0.5f;

EG_INLINE Float score_density(Float u) {
    return kEvenShare + (1.0f - kEvenShare) * 2.0f * abs(2.0f * saturate(u) - 1.0f);
}

// Inverse of the distribution function of u. Below u = 1/2 that function is (2 - F) u - 2 (1 - F) u^2.
EG_INLINE Float score_place(Float share) {
    constexpr float a = 2.0f * (1.0f - kEvenShare), b = 2.0f - kEvenShare;
    const Float less = min(share, 1.0f - share);
    const Float u = 2.0f * less / (b + sqrt(max(b * b - 4.0f * a * less, 0.0f)));
    return select(share < 0.5f, u, min(1.0f - u, splat(0.99999994f)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
