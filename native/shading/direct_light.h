// What the interior term's estimators of direct light share.
#pragma once

#include "sampling/hemisphere.h"
#include "shading/emitters.h"

namespace edgegrad::EDGEGRAD_ISA {

struct LightRandom {
    Float emitter_u, emitter_v, environment_u, environment_v;
};

EG_INLINE LightRandom light_random(const SceneView& scene, UInt stream, UInt index) {
    LightRandom r{splat(0.5f), splat(0.5f), splat(0.5f), splat(0.5f)};
    if (scene.emitter_count > 0) sobol_pair(stream, index, kPairLight, r.emitter_u, r.emitter_v);
    if (scene.has_environment) sobol_pair(stream, index, kPairEnvironment, r.environment_u, r.environment_v);
    return r;
}

// Whether the viewer is on a side of the face that emits.
EG_INLINE Mask on_emitting_side(const SceneView& scene, const SurfacePoint& x) {
    return x.active & ((x.side > 0.0f) | (gather(scene.emission_two_sided, x.material) != 0));
}

}  // namespace edgegrad::EDGEGRAD_ISA
