// GGX normals for the derivative by roughness, not for the picture (derivations, M).
//
// The score d log D / d log(alpha) of a normal is 2 (2u - 1) where the surface is seen from above, u the
// number that `sample_normal` turns into the normal's slope: negative in the middle of a lobe, positive
// around it. The picture's u are even. These have the density F + (1 - F) 2 |2u - 1|: both signs in
// proportion to what they bring, by one map that is monotone, so that numbers that are well spread stay so. F
// of them are the picture's, for light whose own derivative the lobe only passes on.
#pragma once

#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

// Of 1, 0.5 and 0.25, for the last one where lobes have all samples: relative variances of roughness_env
// 0.023, 0.023, 0.028 (16 samples); where they have half of them, a room of one dielectric 13.1, 9.6 (4
// samples).
constexpr float kEvenShare = 0.5f;

EG_INLINE Float score_density(Float u) {
    return kEvenShare + (1.0f - kEvenShare) * 2.0f * abs(2.0f * saturate(u) - 1.0f);
}

// The u below which the part `share` of them lies: below 1/2 that part is (2 - F) u - 2 (1 - F) u^2.
EG_INLINE Float score_place(Float share) {
    constexpr float a = 2.0f * (1.0f - kEvenShare), b = 2.0f - kEvenShare;
    const Float less = min(share, 1.0f - share);
    const Float u = 2.0f * less / (b + sqrt(max(b * b - 4.0f * a * less, 0.0f)));
    return select(share < 0.5f, u, min(1.0f - u, splat(0.99999994f)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
