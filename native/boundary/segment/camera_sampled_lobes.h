// Selects the lobes at the camera's first vertex whose boundary samples start at the camera.
#pragma once

#include "shading/surface_shader.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The camera-sampled lobes of a shader that the camera sees (boundary/terms/camera_sampled.h), as bits 1 <<
// RayKind of their scattering. If one lobe's alpha is at most `camera_sampled_alpha`, these are all lobes but
// the diffuse ones. For a gloss over a diffuse base the limit is kWeakGloss * camera_sampled_alpha.
EG_INLINE Int camera_sampled_kinds(const Shader& shader, float camera_sampled_alpha) {
    if (!(camera_sampled_alpha > 0.0f)) return splat(0);
    const auto is = [&](ShaderKind kind) { return shader.kind == splat(static_cast<int>(kind)); };
    const Mask principled = is(kPrincipled) | is(kDisney);
    const Mask weak = principled & (shader.row[kMetallic] + shader.row[kTransmission] < 0.5f);
    const Float widest = select(weak, splat(kWeakGloss * camera_sampled_alpha), camera_sampled_alpha);
    const auto sharp = [&](int place) { return shader.row[place] * shader.row[place] <= widest; };
    const Mask coated = principled & (shader.row[kCoatWeight] > 0.0f) & sharp(kCoatRoughness);
    return select(
        has(shader, kHasGlossy | kHasRefraction) & ~(is(kSheen) | is(kVelvet)) & (coated | sharp(kRoughness)),
        splat(kScatteredRays & ~(1 << kDiffuseRay)), splat(0));
}

}  // namespace edgegrad::EDGEGRAD_ISA
