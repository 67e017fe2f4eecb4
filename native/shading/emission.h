// Emission of surfaces.
#pragma once

#include "shading/bsdf/principled.h"
#include "shading/surface_shader.h"

namespace edgegrad::EDGEGRAD_ISA {

// Emission of one closure on the viewer's side. The transparent share of the surface does not emit.
EG_INLINE Vec3 closure_emission(const SurfacePoint& x, const Shader& shader, const TexturePoint& point) {
    const Mask emits =
        x.active & has(shader, kHasEmission) & ((x.side > 0.0f) | has(shader, kEmissionTwoSided));
    Vec3 emission = shader.color(kEmission) * shader.scale;
    const Mask covered = emits & has(shader, kHasGlossy) & (shader.kind == splat(kPrincipled));
    if (any(covered))
        emission = emission *
                   emission_share(covered, material_values(shader.row), point.normal, x.normal, point.view);
    return select(emits, emission, zero3());
}

// Mean emission of all closures of the point's material, with opacity: what emitter samples find at this
// point.
EG_OUTLINE Vec3 emitted_radiance(const SceneView& scene, const SurfacePoint& x, const TexturePoint& point) {
    Vec3 sum = zero3();
    const Int first = gather(scene.material_first_closure, x.material);
    const Int count = closure_count(scene, x.material);
    for (Int k = splat(0); any(x.active & (k < count)); k = k + 1) {
        SurfacePoint part = x;
        part.active = x.active & (k < count);
        const Int closure = select(part.active, first + k, first);
        const Shader shader = closure_shader(scene, part, closure, point);
        Vec3 color;
        const Float opacity = 1.0f - passing_share(shader, color);
        const Float weight = select(count > 1, closure_weight(scene, part.active, closure, point), 1.0f);
        sum = sum + closure_emission(part, shader, point) * (opacity * weight);
    }
    return sum;
}

}  // namespace edgegrad::EDGEGRAD_ISA
