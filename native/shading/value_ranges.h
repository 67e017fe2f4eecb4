// What textures may give for a shader's fields.
#pragma once

#include <initializer_list>

#include "scene/material_params.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// The field's values in [0, most].
template <int N>
EG_INLINE void keep_within(Float* row, int place, float most) {
    for (int k = place; k < place + N; ++k) row[k] = min(max(row[k], 0.0f), splat(most));
}

// Values outside of a field's range count as its nearest end, so that their derivative is 0; at the end
// itself it is that of values inside. Ranges are those of Cycles, which bounds shares and roughnesses by 0
// and 1, but the layers that are added to others (coat, sheen, the dielectric level) and colours by 0 alone.
// Cycles also lets emission and transparent surfaces take light away, by negative colours: these count as
// black. Indices and anisotropies are bounded where they are used.
//
// `flags` are those of all shaders. If `lambertian`, these scatter like Lambert's, and rows have no more than
// that needs.
EG_INLINE void keep_in_ranges(Float* row, int32_t flags, bool lambertian) {
    constexpr float kNone = __builtin_inff();
    keep_within<3>(row, kBaseColor, kNone);
    if (flags & kHasEmission) keep_within<3>(row, kEmission, kNone);
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
