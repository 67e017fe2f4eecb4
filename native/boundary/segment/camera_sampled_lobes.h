// Selects the lobes at the camera's first vertex whose boundary samples start at the camera.
#pragma once

#include "shading/surface_shader.h"
#include "tasks/render_options.h"

namespace edgegrad::EDGEGRAD_ISA {

// The lobes of a shader that the camera sees, as bits 1 << RayKind of their scattering: if one lobe's alpha
// is at most `widest`, all but the diffuse ones. For a gloss over a diffuse base the limit is
// kWeakCameraSampled * widest.
EG_INLINE Int sharp_kinds(const Shader& shader, float widest) {
    const auto is = [&](ShaderKind kind) { return shader.kind == splat(kind); };
    const Mask principled = is(kPrincipled) | is(kDisney);
    const Mask weak = principled & (shader.row[kMetallic] + shader.row[kTransmission] < 0.5f);
    const Float limit = select(weak, splat(kWeakCameraSampled * widest), widest);
    const auto sharp = [&](int place) { return shader.row[place] * shader.row[place] <= limit; };
    const Mask coated = principled & (shader.row[kCoatWeight] > 0.0f) & sharp(kCoatRoughness);
    return select(
        has(shader, kHasGlossy | kHasRefraction) & ~(is(kSheen) | is(kVelvet)) & (coated | sharp(kRoughness)),
        splat(kScatteredRays & ~(1 << kDiffuseRay)), splat(0));
}

// Which of them are camera-sampled (boundary/terms/camera_sampled.h).
struct CameraSampledLobes {
    float widest = 0.0f;       // by alpha; 0: none
    Mask of_table = splat(0);  // lanes with shadows of lights, the environment excluded
};

EG_INLINE Int camera_sampled_kinds(const Shader& shader, const CameraSampledLobes& lobes) {
    if (!(lobes.widest > 0.0f)) return splat(0);
    constexpr int kThrough = 1 << kTransmissionRay;
    Int reflected = sharp_kinds(shader, lobes.widest);
    if (any(lobes.of_table))
        reflected = select(lobes.of_table, sharp_kinds(shader, kReflectedShadows * lobes.widest), reflected);
    return (sharp_kinds(shader, kCameraSampledThrough * lobes.widest) & kThrough) | (reflected & ~kThrough);
}

}  // namespace edgegrad::EDGEGRAD_ISA
