// Transmittance of a surface point.
#pragma once

#include "shading/surface_shader.h"
#include "tasks/records/transparent_surfaces.h"

namespace edgegrad::EDGEGRAD_ISA {

// Transmittance of a surface point by channel: the weighted sum over its closures.
EG_OUTLINE Vec3 surface_transmittance(const SceneView& scene, const SurfacePoint& x,
                                      const TexturePoint& point) {
    Vec3 sum = zero3();
    const Int first = gather(scene.material_first_closure, x.material);
    const Int count = closure_count(scene, x.material);
    for (Int k = splat(0); any(x.active & (k < count)); k = k + 1) {
        const Mask here = x.active & (k < count);
        const Int closure = select(here, first + k, first);
        SurfacePoint part = x;
        part.active =
            here & ((gather(scene.closure_flags, closure) & static_cast<int32_t>(kHasTransparency)) != 0);
        if (!any(part.active)) continue;
        const Shader shader = closure_shader(scene, part, closure, point);
        Vec3 color;
        const Float share = passing_share(shader, color) * closure_weight(scene, part.active, closure, point);
        sum = sum + select(part.active, color * share, zero3());
    }
    return sum;
}

// Lanes whose transparent share has a derivative at 0 and at 1 too.
EG_INLINE Mask share_ends_change(const TransparentMemory& passed, Int closure) {
    return passed.closures ? (gather(passed.closures, closure) & static_cast<int32_t>(kEndsChange)) != 0
                           : splat(0);
}

// Probability of passing a surface whose share is 0 or 1 but has a derivative. The less useful choice, which
// only samples the derivative of the share, gets the smaller part.
EG_INLINE Float chance_at_ends(Float share) { return select(share > 0.5f, splat(0.75f), splat(0.25f)); }

}  // namespace edgegrad::EDGEGRAD_ISA
