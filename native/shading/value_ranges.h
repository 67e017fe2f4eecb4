// Ranges of textured closure values.
#pragma once

#include <initializer_list>

#include "scene/material_params.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// Clamps the field's values to [0, most].
template <int N>
EG_INLINE void keep_within(Float* row, int place, float most) {
    for (int k = place; k < place + N; ++k) row[k] = min(max(row[k], 0.0f), splat(most));
}

// Clamps values to the range of their field, so that the derivative outside the range is 0; at an end of the
// range it is that of the inside. The ranges are those of Cycles, which bounds shares and roughnesses by 0
// and 1. Layers that are added to others (coat, sheen, the dielectric level) and colours are bounded by 0
// only. Negative emission removes light. In Cycles negative colours of transparent closures do so, too; here
// they count as black. Indices and anisotropies are bounded where they are used.
//
// `flags` are those of all closures. If `lambertian`, all closures are Lambertian and rows hold only the
// values that these need.
EG_INLINE void keep_in_ranges(Float* row, int32_t flags, bool lambertian) {
    constexpr float kNone = __builtin_inff();
    keep_within<3>(row, kBaseColor, kNone);
    if (flags & kHasTransparency) keep_within<1>(row, kAlpha, 1.0f);
    if (flags & kHasNormalMap) keep_within<1>(row, kNormalStrength, kNone);
    if (lambertian) return;
    for (int share : {kMetallic, kRoughness, kDiffuseRoughness, kTransmission, kCoatRoughness,
                      kSheenRoughness, kSubsurfaceWeight})
        keep_within<1>(row, share, 1.0f);
    for (int layer : {kSpecularIorLevel, kCoatWeight, kSheenWeight}) keep_within<1>(row, layer, kNone);
    for (int tint : {kSpecularTint, kCoatTint, kSheenTint}) keep_within<3>(row, tint, kNone);
}

}  // namespace edgegrad::EDGEGRAD_ISA
