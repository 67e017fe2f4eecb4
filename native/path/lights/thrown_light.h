// Light of the table and of the environment that narrow lobes throw on rougher surfaces, which recorded paths
// differentiate at a fixed microfacet normal.
//
// The camera does not see such a lobe by followed lobes alone (shading/bsdf/followed_lobes.h). Its rays keep
// their directions, since outlines of what they meet have other estimators. At a fixed point of a light the
// lobe would change by d log f ~ 1/alpha. So the light along reflections of narrow lobes is a strategy of its
// own: with a fixed microfacet normal h in the surface's frame, light arrives along the reflection w(v, h),
//   L = int F(h.v) D(h) G2(v, w)/v.z (h.v) s(h, w) L_e(w(v, h)) V dh,
// and what h shows of lights moves with the surface. It jumps at outlines of lights and at edges before them
// (boundary/caustics/caustic_path.h). Emitter samples find the rest of the light, f (1 - s). The environment
// is found by the rays of paths; for its rest they keep their directions.
//
// The share s is that of rays of followed lobes (shading/bsdf/distributions/tail.h), 1 for the environment,
// times a factor that vanishes in the plane of the face: there smooth-shaded faces cut off what the lobe
// shows, and only emitter samples have an estimator for that (boundary/terms/horizon.h).
#pragma once

#include "path/lights/lobe_light.h"
#include "path/recorder.h"
#include "shading/bsdf/perfect_lobes.h"

namespace edgegrad::EDGEGRAD_ISA {

// The part of the emitter samples that follow such lobes.
constexpr float kThrownSamples = 0.5f;

// A sample of thrown light.
struct ThrownSample {
    Mask active = splat(0);
    Int lobe = splat(0);
    Vec3 half = zero3();  // microfacet normal in the lobe's frame
};

// Samples the light that one of the lobes in `bits` throws.
EG_OUTLINE LightSample sample_thrown_light(const SceneView& scene, Mask active, const SurfacePoint& x,
                                           const ShadedSurface& surface, Int bits, Int bounces, Float choice,
                                           Float u, Float v, Float which, ThrownSample& thrown) {
    Bsdf f = surface.bsdf;
    follow_lobes(f, bits);
    // Choose a lobe and sample its microfacet normal
    const auto chance = [&](Lobe k) {
        return select((bits & (1 << k)) != 0, detach(f.probability[k]), splat(0.0f));
    };
    const Float mirror = chance(kMirrorLobe), sum = mirror + chance(kCoatLobe);
    const Mask coat = choice * sum >= mirror;
    const Vec3 view = select(coat, f.view, f.turned_view);
    const Microfacets facets = select_facets(coat, f.coat.facets, f.mirror.facets);
    thrown.lobe = select(coat, splat(kCoatLobe), splat(kMirrorLobe));
    thrown.half = sample_normal(facets, view, splat(1.0f), u, v);
    const Float density = followed_density(facets, view, splat(1.0f), dot(thrown.half, view)) *
                          select(coat, sum - mirror, mirror) / max(sum, 1e-20f);
    const Specular s = scatter_specular(f, thrown.lobe, splat(0), active, thrown.half);
    active &= (density > 0.0f) & (largest_component(s.value) > 0.0f) & (dot(x.normal, s.wi) > 0.0f);
    // Sample one of the lights along the reflection
    Float count;
    LightSample light = sample_met_light(scene, active, x, s.wi, splat(kGlossyRay), bounces, which, count);
    thrown.active = light.active;
    const RayLobe lobe = lobe_of_rays(f, thrown.lobe, splat(0), thrown.half);
    const Float share = share_of_rays(lobe, followed_for(scene, light.active, light.row));
    light.geometry = count * share / max(density, 1e-20f);
    light.active &= share > 0.0f;
    light.pdf = splat(0.0f);
    return light;
}

// Records the density of a ray's microfacet normal, with respect to D(h) dh, if one of the lobes in
// `throwing` has sampled it. Where it meets nothing, that lobe throws the environment's light.
EG_INLINE void record_thrown_ray(Vertex& v, Mask active, const Bsdf& f, Int throwing, const BsdfSample& s) {
    const Mask coat = s.lobe == splat(kCoatLobe);
    const Mask thrown = active & s.active & ~s.transmitted & ~s.specular & (((throwing >> s.lobe) & 1) != 0);
    if (!any(thrown)) return;
    const Vec3 view = select(coat, f.view, f.turned_view);
    const Microfacets g = select_facets(coat, f.coat.facets, f.mirror.facets);
    const Float density =
        score_pdf(g, view, g.bound, s.half, followed_density(g, view, g.bound, dot(s.half, view)));
    const Float chance = select(coat, f.probability[kCoatLobe], f.probability[kMirrorLobe]);
    put(v.thrown_scale, thrown, 1.0f / max(chance * density, 1e-30f));
}

// Samples the light that a surface receives: part of the samples are thrown light of the lobes in `throwing`.
EG_OUTLINE LightSample sample_light_and_thrown(const SceneView& scene, PathPacket p, const SurfacePoint& x,
                                               const ShadedSurface& surface, const PathIndex& index,
                                               UInt number, Float u, Float v, const Vec3* shading,
                                               Int throwing, ThrownSample& thrown) {
    const Mask throws = p.active & (throwing != 0), taken = throws & (u < kThrownSamples);
    const Float rest = select(throws & ~taken, (u - kThrownSamples) / (1.0f - kThrownSamples), u);
    // Find the rest of the light by other samples
    PathPacket others = p;
    others.active &= ~taken;
    ShadedSurface unthrown = surface;
    follow_lobes(unthrown.bsdf, throwing);
    LightSample s = sample_light_and_lobes(scene, others, x, unthrown, index, number, rest, v, shading);
    s.geometry = select(throws & ~taken, s.geometry * (1.0f / (1.0f - kThrownSamples)), s.geometry);
    if (!any(taken)) return s;
    Float choice, which;
    sobol_pair(index.stream, number, vertex_pair(p.vertex, kVertexEnvironment), choice, which);
    LightSample light = sample_thrown_light(scene, taken, x, surface, throwing, bounces_before(p), choice,
                                            u * (1.0f / kThrownSamples), v, which, thrown);
    light.geometry = light.geometry * (1.0f / kThrownSamples);
    return select(taken, light, s);
}

}  // namespace edgegrad::EDGEGRAD_ISA
