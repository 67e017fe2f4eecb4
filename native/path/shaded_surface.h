// A surface of any shader, as paths scatter off it.
#pragma once

#include "shading/bsdf/bsdf.h"
#include "shading/surface_shader.h"

namespace edgegrad::EDGEGRAD_ISA {

struct ShadedSurface {
    Vec3 normal;  // shading normal, on the viewer's side
    Bsdf bsdf;
    Mask transmits;

    static constexpr bool kSmooth = false;  // a mirror finds light that no emitter sample does

    EG_INLINE Mask both_sides() const { return transmits; }
    EG_INLINE BsdfValue evaluate(Mask active, Vec3 w) const {
        return EDGEGRAD_ISA::evaluate(bsdf, active, w);
    }
    EG_INLINE BsdfSample sample(Mask active, Float lobe_u, Float u, Float v) const {
        return EDGEGRAD_ISA::sample(bsdf, active, lobe_u, u, v);
    }
};

EG_INLINE ShadedSurface shaded_surface(const SceneView& scene, Mask active, const SurfacePoint& x,
                                       const TexturePoint& point, const Shader& shader, Vec3 normal) {
    Vec3 tangent = zero3();
    if (scene.all_flags & kAnisotropic) {
        const Mask turned = active & has(shader, kAnisotropic);
        if (any(turned)) tangent = surface_tangent(scene, turned, shader.leaf, point, normal);
    }
    const Mask transmits = has(shader, kHasRefraction) | (shader.kind == static_cast<int>(kTranslucent)) |
                           (shader.kind == static_cast<int>(kDisney));
    return {normal,
            make_bsdf(active, shader.kind, shader.flags, material_values(shader.row), normal, x.normal,
                      tangent, x.side < 0.0f, point.view),
            transmits};
}

}  // namespace edgegrad::EDGEGRAD_ISA
