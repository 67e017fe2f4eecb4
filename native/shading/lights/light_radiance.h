// Radiance of emitter samples on surfaces with varying emission.
#pragma once

#include "shading/emission.h"
#include "shading/lights/light_samples.h"

namespace edgegrad::EDGEGRAD_ISA {

// Evaluates the radiance of emitter samples on surfaces whose emission is not constant, as rays of `kind` see
// it.
EG_INLINE void look_up_emission(const SceneView& scene, LightSample& s, Int kind) {
    if (!scene.emission_varies) return;
    const Mask on_surface = s.active & (s.face >= 0);
    if (!any(on_surface)) return;
    const SurfacePoint y = surface_point(scene, on_surface, s.face, s.b1, s.b2, s.w);
    s.radiance =
        select(on_surface, emitted_radiance(scene, y, texture_point(scene, y, -s.w, kind)), s.radiance);
}

}  // namespace edgegrad::EDGEGRAD_ISA
