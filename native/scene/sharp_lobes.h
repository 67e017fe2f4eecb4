// Which shaders have lobes so sharp that what lights them is looked for along those, or perfect ones.
#pragma once

#include "scene/closure_programs.h"
#include "scene/material_params.h"
#include "scene/tables.h"

namespace edgegrad {

// Whether a shader without textures has a lobe, not perfect, of an alpha up to `widest`; of a gloss over a
// diffuse base kWeakGloss of that.
inline bool has_sharp_lobe(const SceneTables& tables, size_t closure, float widest) {
    if (!(tables.closure_flags[closure] & (kHasGlossy | kHasRefraction)) ||
        tables.closure_kind[closure] == kSheen)
        return false;
    const float* row = tables.closure_params.data() + kMaterialParams * closure;
    const bool principled =
        tables.closure_kind[closure] == kPrincipled || tables.closure_kind[closure] == kDisney;
    if (principled && row[kMetallic] + row[kTransmission] < 0.5f) widest *= kWeakGloss;
    const auto sharp = [&](int place) { return row[place] > 0.0f && row[place] * row[place] <= widest; };
    return sharp(kRoughness) || (row[kCoatWeight] > 0.0f && sharp(kCoatRoughness));
}

// Whether a shader may have a transmission lobe that isn't perfect.
inline bool may_refract_roughly(const SceneTables& tables, size_t closure) {
    const float* row = tables.closure_params.data() + closure * kMaterialParams;
    return (tables.closure_flags[closure] & kHasRefraction) &&
           (row[kRoughness] > 0.0f || is_textured(tables, closure, kRoughness));
}

// Whether a shader may be a perfect mirror, or glass that is perfectly smooth, or may have a lobe of an alpha
// up to `followed` that is followed like those (shading/bsdf/followed_lobes.h). (Textures of roughness may
// say so anywhere.)
inline bool may_be_specular(const SceneTables& tables, size_t closure, float followed = 0.0f) {
    if (!(tables.closure_flags[closure] & (kHasGlossy | kHasRefraction))) return false;
    const float* row = tables.closure_params.data() + closure * kMaterialParams;
    constexpr float kSmooth = 4e-3f;  // its fourth power is beyond what is taken for smooth
    const auto smooth = [&](int place) {
        return row[place] < kSmooth || row[place] * row[place] <= followed ||
               is_textured(tables, closure, place);
    };
    const bool coat = tables.closure_kind[closure] == kPrincipled &&
                      (row[kCoatWeight] > 0.0f || is_textured(tables, closure, kCoatWeight));
    return smooth(kRoughness) || (coat && smooth(kCoatRoughness));
}

inline bool may_be_specular(const SceneTables& tables, float followed = 0.0f) {
    for (size_t closure = 0; closure < tables.closure_flags.size(); ++closure)
        if (may_be_specular(tables, closure, followed)) return true;
    return false;
}

}  // namespace edgegrad
