// Closures with lobes so sharp that light is sampled along the lobes, and closures with perfect lobes.
#pragma once

#include "scene/closure_programs.h"
#include "scene/material_params.h"
#include "scene/tables.h"

namespace edgegrad {

// Lobes up to this alpha are sharp for recorded paths: each emitter sample sees enough of a light in wider
// ones (path/lights/lobe_light.h).
constexpr float kSharpAlpha = 0.35f;

// Returns whether a closure without textures has a lobe with an alpha up to `widest` that is not perfect. For
// a gloss over a diffuse base the limit is `weak` times that.
inline bool has_sharp_lobe(const SceneTables& tables, size_t closure, float widest, float weak = kWeakGloss) {
    if (!(tables.closure_flags[closure] & (kHasGlossy | kHasRefraction)) ||
        tables.closure_kind[closure] == kSheen || tables.closure_kind[closure] == kVelvet)
        return false;
    const float* row = tables.closure_params.data() + kMaterialParams * closure;
    const bool principled =
        tables.closure_kind[closure] == kPrincipled || tables.closure_kind[closure] == kDisney;
    if (principled && row[kMetallic] + row[kTransmission] < 0.5f) widest *= weak;
    const auto sharp = [&](int place) { return row[place] > 0.0f && row[place] * row[place] <= widest; };
    return sharp(kRoughness) || (row[kCoatWeight] > 0.0f && sharp(kCoatRoughness));
}

// Returns whether a closure scatters light from behind its surface.
inline bool scatters_through(const SceneTables& tables, size_t closure) {
    const int32_t kind = tables.closure_kind[closure];
    return (tables.closure_flags[closure] & kHasRefraction) || kind == kTranslucent || kind == kDisney;
}

// Returns whether a closure may have a transmission lobe that is not perfect. `widened`: perfect lobes are
// rough behind diffuse bounces (shading/bsdf/filter_glossy.h).
inline bool may_refract_roughly(const SceneTables& tables, size_t closure, bool widened) {
    const float* row = tables.closure_params.data() + closure * kMaterialParams;
    return (tables.closure_flags[closure] & kHasRefraction) &&
           (widened || row[kRoughness] > 0.0f || is_textured(tables, closure, kRoughness));
}

// Returns whether a closure may have a rough diffuse lobe with a rim (shading/bsdf/diffuse_rim.h), which only
// shading normals of their own can have.
inline bool may_have_diffuse_rim(const SceneTables& tables, size_t closure) {
    const float* row = tables.closure_params.data() + closure * kMaterialParams;
    const int32_t kind = tables.closure_kind[closure];
    return (kind == kDiffuse || kind == kPrincipled) &&
           (row[kDiffuseRoughness] > 0.0f || is_textured(tables, closure, kDiffuseRoughness)) &&
           (!tables.corner_normal.empty() || (tables.closure_flags[closure] & kHasNormalMap));
}

// Returns whether a closure may have gloss that ends with a jump where light of the light table arrives along
// the smooth surface (path/shaded_surface.h).
inline bool may_have_gloss_rim(const SceneTables& tables, size_t closure) {
    const int32_t flags = tables.closure_flags[closure];
    return (flags & kHasNormalMap) &&
           ((flags & (kHasGlossy | kHasRefraction)) || tables.closure_kind[closure] == kVelvet);
}

// Returns whether a closure may scatter no light from where its normals point away from the viewer. Gloss
// ends there if they point below the surface, too (shading/bsdf/shading_normal.h). `below`: shading normals
// of its meshes do so.
inline bool may_end_at_its_normal(const SceneTables& tables, size_t closure, bool below) {
    const int32_t flags = tables.closure_flags[closure], kind = tables.closure_kind[closure];
    if (kind == kVelvet) return (flags & kHasNormalMap) || !tables.corner_normal.empty();
    return (below || (flags & kNormalBelow)) &&
           ((flags & (kHasGlossy | kHasRefraction)) || kind == kTranslucent);
}

// Returns whether a closure may have a rough lobe that ends with a jump for all light.
inline bool may_have_lobe_rim(const SceneTables& tables, size_t closure, bool widened) {
    return may_refract_roughly(tables, closure, widened) || may_have_diffuse_rim(tables, closure);
}

// Returns whether a closure may have any rim (path/rim.h).
inline bool may_have_rim(const SceneTables& tables, size_t closure, bool widened) {
    return may_have_lobe_rim(tables, closure, widened) ||
           (!tables.lights.kind.empty() && may_have_gloss_rim(tables, closure));
}

// Returns whether a closure may be a perfect mirror or perfectly smooth glass, or may have a followed lobe
// with an alpha up to `followed` (shading/bsdf/followed_lobes.h).
inline bool may_be_specular(const SceneTables& tables, size_t closure, float followed = 0.0f) {
    if (!(tables.closure_flags[closure] & (kHasGlossy | kHasRefraction))) return false;
    const float* row = tables.closure_params.data() + closure * kMaterialParams;
    // Its fourth power, alpha squared, is above the limit of smooth lobes (kSmoothAlpha2), also after
    // rounding.
    constexpr float kSmooth = 4e-3f;
    // Phong lobes become mirrors earlier (kLeastPhongAlpha).
    constexpr float kSmoothPhong = 1.01e-2f;
    const float limit = tables.closure_flags[closure] & kPhong ? kSmoothPhong : kSmooth;
    const auto smooth = [&](size_t coat) {
        const float roughness = tables.least_roughness[2 * closure + coat];
        return roughness < limit || roughness * roughness <= followed;
    };
    const bool coat = tables.closure_kind[closure] == kPrincipled &&
                      (row[kCoatWeight] > 0.0f || is_textured(tables, closure, kCoatWeight));
    return smooth(0) || (coat && smooth(1));
}

// Returns whether a closure may throw light on other surfaces as a mirror or smooth glass, or by a narrow
// lobe with an alpha up to `thrown` (path/lights/thrown_light.h), which interfaces do not.
inline bool may_throw_light(const SceneTables& tables, size_t closure, float thrown) {
    const int32_t kind = tables.closure_kind[closure];
    return may_be_specular(tables, closure, kind == kGlass || kind == kRefraction ? 0.0f : thrown);
}

inline bool may_be_specular(const SceneTables& tables, float followed = 0.0f) {
    for (size_t closure = 0; closure < tables.closure_flags.size(); ++closure)
        if (may_be_specular(tables, closure, followed)) return true;
    return false;
}

}  // namespace edgegrad
