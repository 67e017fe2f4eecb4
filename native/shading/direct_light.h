// Radiance that leaves a diffuse surface towards the viewer, by emission and direct light:
//   L = L_e + albedo/pi * ( sum over finite emitters  int L_e (n.w) |w.n_y| V / r^2 dA_y
//                           + int L_env(w) (n.w) V dw ).
// One sample of each integral.
#pragma once

#include "boundary/edge_point.h"
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

// Emission of the face on the viewer's side.
EG_INLINE Vec3 emitted(const SceneView& scene, const SurfacePoint& x) {
    if (!scene.any_emission) return zero3();
    return select(on_emitting_side(scene, x), gather3(scene.emission, x.material), zero3());
}

// Direct light at x through albedo/pi, the albedo left out.
EG_INLINE Vec3 direct_light(const SceneView& scene, const SurfacePoint& x, const LightRandom& random) {
    Vec3 sum = zero3();
    if (scene.emitter_count > 0) {
        EmitterSample s = sample_emitter(scene, x.active, x, random.emitter_u, random.emitter_v);
        s.active &= ~hidden_by_edge(scene, s.active, x, s.w);
        const Mask lit = scene.convex ? s.active : s.active & ~emitter_hidden(scene, x, s);
        sum = select(lit, s.radiance * (s.geometry * s.cosine * kInvPi), sum);
    }
    if (scene.has_environment) {
        if (scene.convex) return sum + select(x.active, splat3(scene.environment), zero3());
        const Vec3 w = cosine_direction(x.normal, random.environment_u, random.environment_v);
        const Mask open = x.active & ~hidden_by_edge(scene, x.active, x, w);
        const Mask hidden = occluded_from(scene, open, x, w, splat(__builtin_inff()));
        // cos/pi is the density: it cancels with cos * albedo/pi.
        sum = sum + select(open & ~hidden, splat3(scene.environment), zero3());
    }
    return sum;
}

// The radiance L above for paths of up to `max_depth` segments.
EG_INLINE Vec3 outgoing_radiance(const SceneView& scene, const SurfacePoint& x, int max_depth,
                                 const LightRandom& random) {
    Vec3 radiance = emitted(scene, x);
    if (max_depth < 2) return radiance;
    const Vec3 albedo = gather3(scene.albedo, x.material);
    SurfacePoint lit = x;
    lit.active &= largest_component(albedo) > 0.0f;  // black surfaces need no rays
    if (any(lit.active)) {
        const Vec3 light = direct_light(scene, lit, random);
        radiance = radiance + select(lit.active, albedo * light, zero3());
    }
    return radiance;
}

}  // namespace edgegrad::EDGEGRAD_ISA
