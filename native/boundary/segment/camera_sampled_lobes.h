// Which of the camera's surfaces show boundaries behind them by samples that start at the camera.
#pragma once

#include "shading/surface_shader.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Which lobes of a shader that the camera sees are the aimed estimator's (boundary/terms/camera_sampled.h),
// as bits 1 << RayKind of what they scatter: all but the diffuse ones, where one of them is no wider than
// `aimed`, for a gloss over a diffuse base than kWeakGloss of that.
EG_INLINE Int camera_sampled_kinds(const Shader& shader, float aimed) {
    if (!(aimed > 0.0f)) return splat(0);
    if (aimed >= kAimAtAll) return splat(kScatteredRays);
    const auto is = [&](ShaderKind kind) { return shader.kind == splat(static_cast<int>(kind)); };
    const Mask principled = is(kPrincipled) | is(kDisney);
    const Mask weak = principled & (shader.row[kMetallic] + shader.row[kTransmission] < 0.5f);
    const Float widest = select(weak, splat(kWeakGloss * aimed), aimed);
    const auto sharp = [&](int place) { return shader.row[place] * shader.row[place] <= widest; };
    const Mask coated = principled & (shader.row[kCoatWeight] > 0.0f) & sharp(kCoatRoughness);
    return select(has(shader, kHasGlossy | kHasRefraction) & ~is(kSheen) & (coated | sharp(kRoughness)),
                  splat(kScatteredRays & ~(1 << kDiffuseRay)), splat(0));
}

}  // namespace edgegrad::EDGEGRAD_ISA
