// Which of the camera's surfaces show boundaries behind them by samples that start at the camera.
#pragma once

#include "kernels.h"
#include "shading/surface_shader.h"

namespace edgegrad::EDGEGRAD_ISA {

// Which lobes of a shader that the camera sees are the aimed estimator's (boundary/aimed.h), as bits 1 <<
// RayKind of what they scatter: all but the diffuse ones, where one of them is no wider than `aimed`.
EG_INLINE Int aimed_kinds(const Shader& shader, float aimed) {
    if (!(aimed > 0.0f)) return splat(0);
    if (aimed >= kAimAtAll) return splat(kScatteredRays);
    const auto is = [&](ShaderKind kind) { return shader.kind == splat(static_cast<int>(kind)); };
    const Mask coated = (is(kPrincipled) | is(kDisney)) & (shader.row[kCoatWeight] > 0.0f) &
                        (shader.row[kCoatRoughness] * shader.row[kCoatRoughness] <= aimed);
    const Mask sharp = has(shader, kHasGlossy | kHasRefraction) & ~is(kSheen) &
                       (coated | (shader.row[kRoughness] * shader.row[kRoughness] <= aimed));
    return select(sharp, splat(kScatteredRays & ~(1 << kDiffuseRay)), splat(0));
}

}  // namespace edgegrad::EDGEGRAD_ISA
