// Radiance of emitter samples on surfaces with varying emission.
#pragma once

#include "shading/emission.h"
#include "shading/lights/light_samples.h"

namespace edgegrad::EDGEGRAD_ISA {

// Evaluates the radiance of emitter samples on surfaces whose emission is not constant.
EG_INLINE void look_up_emission(const SceneView& scene, LightSample& s) {
    if (!scene.emission_varies) return;
    const Mask on_surface = s.active & (s.face >= 0);
    if (!any(on_surface)) return;
    const SurfacePoint y = surface_point(scene, on_surface, s.face, s.b1, s.b2, s.w);
    const TexturePoint point = texture_point(scene, y, -s.w, splat(kNoRay), {splat(-1), s.r});
    s.radiance = select(on_surface, emitted_radiance(scene, y, point), s.radiance);
}

}  // namespace edgegrad::EDGEGRAD_ISA
