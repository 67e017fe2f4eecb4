// The transparent share of a surface point.
#pragma once

#include "shading/surface_shader.h"

namespace edgegrad::EDGEGRAD_ISA {

// The share of each channel that passes a surface point: over its leaves, the weighted sum.
EG_OUTLINE Vec3 surface_transmittance(const SceneView& scene, const SurfacePoint& x,
                                      const TexturePoint& point) {
    Vec3 sum = zero3();
    const Int first = gather(scene.material_first_leaf, x.material);
    const Int count = gather(scene.material_first_leaf + 1, x.material) - first;
    for (Int k = splat(0); any(x.active & (k < count)); k = k + 1) {
        const Mask here = x.active & (k < count);
        const Int leaf = select(here, first + k, first);
        SurfacePoint part = x;
        part.active = here & ((gather(scene.leaf_flags, leaf) & static_cast<int32_t>(kHasTransparency)) != 0);
        if (!any(part.active)) continue;
        const Shader shader = leaf_shader(scene, part, leaf, point);
        Vec3 color;
        const Float share = passing_share(shader, color) * leaf_weight(scene, part.active, leaf, point);
        sum = sum + select(part.active, color * share, zero3());
    }
    return sum;
}

}  // namespace edgegrad::EDGEGRAD_ISA
