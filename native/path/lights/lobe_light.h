// Emitter samples of recorded paths along sharp lobes.
//
// Rays of pictures meet the sized lights of the table, which finds their light in sharp lobes. Rays of
// recorded paths do so only behind perfect and followed lobes: a light has no vertices that a ray's end could
// move with. Light of other lobes, and small light in followed ones, is found by emitter samples alone, each
// a fixed point of its light. Where a surface has such sharp lobes, part of these samples therefore choose
// the point that a direction of such a lobe meets. With p the density of directions by `sample_light`, q that
// of the lobes, n the number of lights along a direction, and c the part of the second kind, the density of a
// sample is
//   (1 - c) p + c q/n                                           (derivations, A7).
#pragma once

#include "path/path_queue.h"
#include "path/shaded_surface.h"
#include "path/stream.h"
#include "scene/sharp_lobes.h"
#include "shading/lights/lights.h"
#include "shading/lights/met_light.h"

namespace edgegrad::EDGEGRAD_ISA {

// The part c: this much, and as much again where the lobes reflect all light.
constexpr float kLeastLobeSamples = 0.25f;

struct SharpLobes {
    Mask active;
    Bsdf bsdf;    // its other lobes have the probability 0
    Float share;  // c
};

// The microfacets of lobe number k, which is a mirror, the coat or an interface.
EG_INLINE const Microfacets& facets_of(const Bsdf& f, int k) {
    return k == kMirrorLobe ? f.mirror.facets : k == kCoatLobe ? f.coat.facets : f.glass.facets;
}

// Lanes in which lobe number k is sharp and not perfect.
EG_INLINE Mask is_sharp(const Bsdf& f, int k) {
    if (!f.any_lobe[k] || (k != kMirrorLobe && k != kCoatLobe && k != kInterfaceLobe)) return splat(0);
    const Microfacets& g = facets_of(f, k);
    return (f.probability[k] > 0.0f) & ~is_smooth(g) & (min(g.ax, g.ay) <= kSharpAlpha);
}

// Lanes with any sharp lobe.
EG_INLINE Mask any_sharp(const Bsdf& f) {
    return is_sharp(f, kMirrorLobe) | is_sharp(f, kCoatLobe) | is_sharp(f, kInterfaceLobe);
}

// The lobes of a surface that are sharp and not perfect, and whose rays do not meet every light of the table.
// Where the camera sees the surface, lobes wider than the lights (scene.lobe_samples) have no samples.
EG_INLINE SharpLobes sharp_lobes(const SceneView& scene, const ShadedSurface& surface, const PathPacket& p) {
    const Mask active = p.active;
    SharpLobes out{splat(0), surface.bsdf, splat(0.0f)};
    Bsdf& f = out.bsdf;
    Float sum = splat(0.0f);
    for (int k = 0; k < kLobes; ++k) {
        if (!f.any_lobe[k]) continue;
        Mask sharp = active & is_sharp(f, k);
        if (any(sharp)) {
            const Microfacets& g = facets_of(f, k);
            sharp &= (~g.followed | (widest_alpha(g) > scene.least_followed)) &
                     (~p.led | (min(g.ax, g.ay) * width_by_alpha(k) <= scene.lobe_samples));
        }
        f.probability[k] = select(sharp, detach(f.probability[k]), splat(0.0f));
        sum = sum + f.probability[k];
    }
    out.active = active & (sum > 1e-3f);
    out.share = select(out.active, kLeastLobeSamples * (1.0f + sum), splat(0.0f));
    normalize_probabilities(f);
    follow_up_to(f, splat(0.0f));
    return out;
}

// Samples the light in the direction (choice, u, v) of the lobes. The density is set by weigh_lobe_samples.
EG_INLINE LightSample sample_along_lobes(const SceneView& scene, Mask active, const SurfacePoint& x,
                                         const SharpLobes& lobes, Int bounces, Float choice, Float u, Float v,
                                         Float which) {
    const BsdfSample d = sample(lobes.bsdf, active, choice, u, v);
    Float count;
    LightSample s =
        sample_met_light(scene, active & d.active & ~d.specular, x, d.wi, d.ray_kind, bounces, which, count);
    if (any(s.active)) {
        const LightRow l = gather_light(scene.lights, select(s.active, s.row, splat(0)));
        s.share = light_factor(l, s.w, s.r);
        s.radiance = select(s.active, l.radiance * s.share, zero3());
    }
    s.geometry = s.pdf = splat(0.0f);
    return s;
}

// Sets the density and the geometric factor of samples by either strategy.
EG_INLINE void weigh_lobe_samples(const SceneView& scene, const SurfacePoint& x, Mask both_sides,
                                  const Vec3* shading, const SharpLobes& lobes, Int bounces, Mask along_lobes,
                                  LightSample& s) {
    // Lights without size and faces are found by the first strategy alone
    const Float first = 1.0f - lobes.share;
    s.geometry = select(lobes.active & ~along_lobes, s.geometry / first, s.geometry);
    const Mask shared = s.active & lobes.active & (s.row >= 0) & (along_lobes | (s.pdf > 0.0f));
    if (!any(shared)) return;
    // Count the lights along the direction, and find the density of emitter samples of this one
    const Mask above = dot(x.normal, s.w) > 0.0f;
    const Int kind = select(above, splat(kGlossyRay), splat(kTransmissionRay));
    const Receiver from{x.position, x.normal, both_sides, shading};
    Float count = splat(0.0f), emitter = select(along_lobes, splat(0.0f), s.pdf);
    Mask met = splat(0);
    for_each_met_light(scene, shared, x.position, x.mesh, s.w, splat(0.0f), splat(__builtin_inff()), kind,
                       bounces, [&](int row, Mask seen, const LightRow&, Float, Float pdf) EG_INLINE_LAMBDA {
                           count = count + select(seen, splat(1.0f), 0.0f);
                           const Mask own = seen & (s.row == row);
                           met |= own;
                           const Mask unknown = own & along_lobes;
                           if (!any(unknown)) return;
                           const Int light = splat(scene.lights.light_of_row[row]);
                           emitter = select(
                               unknown, pdf * light_probability(scene.lights, unknown, from, light), emitter);
                       });
    const Float lobe = EDGEGRAD_ISA::evaluate(lobes.bsdf, shared & met, s.w).pdf;
    const Float density = first * emitter + select(met, lobes.share * lobe / max(count, 1.0f), splat(0.0f));
    s.geometry = select(shared, 1.0f / max(density, 1e-37f), s.geometry);
    s.active &= ~shared | (density > 0.0f);
}

// v, or the number on the other side of a sharp lobe's middle: lobes are sampled by v, turned about their
// middle.
EG_INLINE Float mirrored(Mask m, Float v) { return select(m, fract(v + 0.5f), v); }

// Samples the light that a surface of a recorded path receives. `number` is that of the sample.
EG_OUTLINE LightSample sample_light_and_lobes(const SceneView& scene, const PathPacket& p,
                                              const SurfacePoint& x, const ShadedSurface& surface,
                                              const PathIndex& index, UInt number, Float u, Float v,
                                              const Vec3* shading) {
    const SharpLobes lobes = sharp_lobes(scene, surface, p);
    const Mask along = lobes.active & (u < lobes.share);
    const Float rest = (u - lobes.share) / max(1.0f - lobes.share, 1e-6f);
    LightSample s = sample_light(scene, p.active & ~along, x, p.both_sides, bounces_before(p),
                                 select(along, splat(0.0f), select(lobes.active, rest, u)), v, shading);
    if (!any(lobes.active)) return s;
    if (any(along)) {
        // Emitter samples do not use the random numbers of the environment's image.
        Float choice, which;
        sobol_pair(index.stream, number, vertex_pair(p.vertex, kVertexEnvironment), choice, which);
        const Float place = min(u / max(lobes.share, kLeastLobeSamples), splat(0.99999994f));
        s = select(along,
                   sample_along_lobes(scene, along, x, lobes, bounces_before(p), choice, place, v, which), s);
    }
    weigh_lobe_samples(scene, x, p.both_sides, shading, lobes, bounces_before(p), along, s);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
