// Dimming of light at grazing angles, which hides the shadow terminator of coarse smooth meshes.
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// Factor of reflected light at the cosine to the shading normal: as in Cycles, its cosine is that of an angle
// `stretch` times as large. Light that is transmitted is not dimmed.
EG_INLINE Float terminator_dimming(Float stretch, Float cosine) {
    constexpr float kLeast = 1e-4f;
    const Mask reflected = (cosine > 0.0f) & (stretch > 1.0f);
    const Float c = clamp(cosine, splat(kLeast), splat(1.0f));
    const Float dimmed = max(cos(acos(c) * stretch), 0.0f) / c;
    return select(reflected, dimmed, 1.0f);
}

}  // namespace edgegrad::EDGEGRAD_ISA
