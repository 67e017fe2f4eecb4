// Surfaces on a chain of perfect mirrors, smooth glass and transparent surfaces, and the scattering events
// there. Followed lobes act as mirrors or glass with a random microfacet normal, which is part of the event
// (shading/bsdf/followed_lobes.h).
#pragma once

#include "path/shaded_surface.h"
#include "path/stream.h"
#include "shading/bsdf/perfect_lobes.h"
#include "tasks/scan_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Bits of an event: a lobe, whether it transmits, and whether it is a followed lobe. Or one of: pass
// unscattered; go on to a light (boundary/specular/chain_light.h); scatter by other lobes towards the next
// stored vertex, which then is in material form (boundary/caustics/caustic_outline.h); end here.
constexpr int32_t kEventLobes = 7, kEventTransmits = 8, kEventPasses = 16, kEventLit = 32, kEventFollows = 64,
                  kEventAims = 128, kEventEnds = -1;

// A ray of a chain.
struct ChainRay {
    Vec3 origin, direction, from;
    Int kind;
    RayLobe lobe;  // the followed lobe that scattered it
};
EG_INLINE ChainRay select(Mask m, const ChainRay& a, const ChainRay& b) {
    return {select(m, a.origin, b.origin), select(m, a.direction, b.direction), select(m, a.from, b.from),
            select(m, a.kind, b.kind), select(m, a.lobe, b.lobe)};
}

// The perfect and followed lobes of a surface.
constexpr int kPerfectLobes = 4;
constexpr int32_t kPerfectEvent[kPerfectLobes] = {kMirrorLobe, kCoatLobe, kInterfaceLobe,
                                                  kInterfaceLobe | kEventTransmits};

struct PerfectLobes {
    // f |cos| at the view, 0 for missing lobes. For followed lobes it is divided by the density of the
    // microfacet normal, with respect to D(h) dh.
    Float value[kPerfectLobes];
    Mask followed[kPerfectLobes];
    Vec3 half[kPerfectLobes];
    Float density[kPerfectLobes];
};

EG_INLINE void perfect_values(const Bsdf& f, Mask active, PerfectLobes& lobes) {
    for (int k = 0; k < kPerfectLobes; ++k) {
        lobes.value[k] = splat(0.0f), lobes.density[k] = splat(1.0f);
        lobes.followed[k] = splat(0), lobes.half[k] = f.normal;
    }
    const Float cosine = f.view.z;
    const auto put = [&](int k, Mask m, Vec3 v) {
        lobes.value[k] = select(active & m, average(v), splat(0.0f));
    };
    if (f.any_lobe[kMirrorLobe])
        put(0, (f.probability[kMirrorLobe] > 0.0f) & is_smooth(f.mirror.facets),
            reflectance(f.mirror, cosine));
    if (f.any_lobe[kCoatLobe])
        put(1, (f.probability[kCoatLobe] > 0.0f) & is_smooth(f.coat.facets), reflectance(f.coat, cosine));
    if (f.any_lobe[kInterfaceLobe]) {
        const Mask has = f.probability[kInterfaceLobe] > 0.0f;
        const Split s = split_light(f.glass, cosine);
        put(2, has & is_smooth(f.glass.facets), s.reflected);
        put(3, has & refracts_smoothly(f.glass), s.transmitted);
    }
}

// Adds followed lobes. The random numbers u and v sample their microfacet normals.
EG_OUTLINE void followed_values(const Bsdf& f, Mask active, Float u, Float v, PerfectLobes& lobes) {
    const auto put = [&](int k, const Microfacets& g, Vec3 view, bool transmits) {
        Mask m = active & g.followed;
        if (transmits) m &= ~refracts_smoothly(f.glass);
        if (!any(m)) return;
        const Vec3 h = sample_normal(g, view, splat(1.0f), u, v);
        const Float density = followed_density(g, view, splat(1.0f), dot(h, view));
        const Specular s =
            scatter_specular(f, splat(kPerfectEvent[k] & kEventLobes), splat(transmits ? -1 : 0), m, h);
        const Mask there = m & (density > 0.0f);
        lobes.value[k] = select(there, average(s.value) / max(density, 1e-20f), lobes.value[k]);
        lobes.density[k] = select(there, density, lobes.density[k]);
        lobes.half[k] = select(there, h, lobes.half[k]);
        lobes.followed[k] |= there;
    };
    if (f.any_lobe[kMirrorLobe]) put(0, f.mirror.facets, f.turned_view, false);
    if (f.any_lobe[kCoatLobe]) put(1, f.coat.facets, f.view, false);
    if (f.any_lobe[kInterfaceLobe])
        put(2, f.glass.facets, f.view, false), put(3, f.glass.facets, f.view, true);
}

// A surface of a chain, with one closure of its material.
struct ChainSurface {
    SurfacePoint x;
    TexturePoint point;
    Shader shader;
    Float closure_weight;  // of the shader in its material
    Float transparency;    // fraction of light that passes unscattered
    Vec3 passing;          // its color
};

EG_OUTLINE ChainSurface chain_surface(const SceneView& scene, const SurfacePoint& x,
                                      const TexturePoint& point, Int closure) {
    ChainSurface s{x, point, closure_shader(scene, x, closure, point), splat(1.0f), splat(0.0f), zero3()};
    if (scene.any_mixture) {
        const Mask mixed = x.active & (closure_count(scene, x.material) > 1);
        if (any(mixed))
            s.closure_weight = select(mixed, closure_weight(scene, mixed, closure, point), s.closure_weight);
    }
    if (scene.all_flags & kHasTransparency) s.transparency = passing_share(s.shader, s.passing);
    return s;
}

EG_OUTLINE ShadedSurface chain_bsdf(const SceneView& scene, Mask active, const ChainSurface& s) {
    const Vec3 normal = shading_normal(scene, active, s.shader, s.point);
    ShadedSurface surface = shaded_surface(scene, active, s.x, s.point, s.shader, normal);
    if (scene.followed_alpha > 0.0f) follow_lobes(surface.bsdf, active, splat(scene.followed_alpha));
    return surface;
}

// Scatters the rays of lanes by the lobe of their event. Sets `shown` to the factor of the light that a
// normal map leaves, and `lobe` to the followed lobe.
EG_OUTLINE Specular scatter_by_event(const SceneView& scene, const ChainSurface& s, Mask scatters, Int event,
                                     Mask transmitted, Vec3 half, Float& shown, RayLobe& lobe) {
    const Shader& shader = s.shader;
    shown = splat(1.0f), lobe = {};
    const Mask followed = scatters & ((event & kEventFollows) != 0);
    if (!(scene.all_flags & kHasNormalMap) && !scene.any_dimming && !any(followed) &&
        !any(scatters & ~scatters_plainly(shader.kind, shader.flags)))
        return scatter_plainly(
            plain_interface(shader.kind, shader.color(kBaseColor), shader.row[kIor], s.x.side < 0.0f),
            valid_mirror_normal(s.point.normal, s.x.normal, s.point.view), s.point.view, event & kEventLobes,
            transmitted);
    const ShadedSurface surface = chain_bsdf(scene, scatters, s);
    const Specular next = scatter_specular(surface.bsdf, event & kEventLobes, transmitted, followed, half);
    if (any(followed))
        lobe = select(followed, lobe_of_rays(surface.bsdf, event & kEventLobes, transmitted, half), {});
    if (surface.smooth || surface.dims) shown = surface.shown(next.wi);
    return next;
}

// Continues the rays of lanes that scatter and sets `value` to the factor on their radiance. Returns the
// lanes with a continuing ray. `below`: the direction is on the wrong side of the face, which interpolated
// and mapped normals can cause; `value` is the factor of rays just above its plane.
EG_OUTLINE Mask scatter_chain(const SceneView& scene, const ChainSurface& s, Mask scatters, Int event,
                              Vec3 half, ChainRay& ray, Vec3& value, Mask& below) {
    const Mask transmitted = (event & kEventTransmits) != 0;
    Float shown;
    RayLobe lobe;
    const Specular next = scatter_by_event(scene, s, scatters, event, transmitted, half, shown, lobe);
    const Float side = dot(s.x.normal, next.wi);
    const Mask shines = scatters & (largest_component(next.value) > 0.0f);
    const Mask above = select(transmitted, side < 0.0f, side > 0.0f);
    const Mask fine = shines & above & (shown > 0.0f);
    below = shines & ~above;
    value = select(below, next.value, next.value * shown);
    ray.origin = select(scatters, leave_surface(s.x, next.wi), ray.origin);
    ray.direction = select(scatters, next.wi, ray.direction);
    ray.from = select(scatters, s.x.position, ray.from);
    ray.kind = select(scatters, select(transmitted, splat(kTransmissionRay), splat(kGlossyRay)), ray.kind);
    ray.lobe = select(scatters, lobe, ray.lobe);
    return fine;
}

// Random numbers in [0, 1) for the choices at a vertex.
EG_INLINE Float chain_random(UInt stream, int level, int which) {
    const uint32_t place = hash(static_cast<uint32_t>(4 * level + which) ^ 0x7f4a7c15u);
    return to_float(bits(hash(stream ^ splat(place)) >> 8)) * 5.9604645e-8f;
}

// The stream of a scan line: its lower bits are the line's number.
constexpr uint32_t kLineBits = 0xfffu;
EG_INLINE uint32_t line_stream(uint32_t lines, int32_t number) {
    return (hash(lines) & ~kLineBits) | (static_cast<uint32_t>(number) & kLineBits);
}

// A pair of numbers in [0, 1) at a vertex that is well distributed over the lines of a tile: a rank-1 lattice
// in two dimensions (the R2 sequence), shifted at random.
EG_INLINE void line_numbers(UInt stream, int level, Float& u, Float& v) {
    const UInt line = stream & splat(kLineBits);
    const auto number = [&](int which, uint32_t step) {
        const uint32_t place = hash(static_cast<uint32_t>(2 * level + which) ^ 0x2545f491u);
        const UInt shifted = hash((stream ^ line) ^ splat(place)) + line * splat(step);
        return to_float(bits(shifted >> 8)) * 5.9604645e-8f;
    };
    u = number(0, 3242174889u), v = number(1, 2447445414u);
}

// The least probability of a possible event, shared among several lobes. It limits the weight of rare events.
constexpr float kLeastChoice = 0.1f;

// Lanes with a lobe that is neither perfect nor followed.
EG_INLINE Mask has_wide_lobes(const Bsdf& f, Mask active) {
    Mask wide = splat(0);
    for (int k = 0; k < kLobes; ++k) {
        if (!f.any_lobe[k]) continue;
        const Mask perfect = k == kMirrorLobe      ? is_perfect(f.mirror.facets)
                             : k == kCoatLobe      ? is_perfect(f.coat.facets)
                             : k == kInterfaceLobe ? is_perfect(f.glass.facets)
                                                   : splat(0);
        wide |= active & (f.probability[k] > 0.0f) & ~perfect;
    }
    return wide;
}

// The sum of the values of lobes, and their number.
struct LobeSum {
    Float value, count;
};
EG_INLINE LobeSum sum_of(const PerfectLobes& lobes) {
    LobeSum sum{splat(0.0f), splat(0.0f)};
    for (const Float& v : lobes.value) {
        sum.value = sum.value + v;
        sum.count = sum.count + select(v > 0.0f, splat(1.0f), 0.0f);
    }
    return sum;
}

// Chooses one of the lobes in proportion to their values; kEventEnds if none has a value. Multiplies the
// `probability`, and sets `half` to the microfacet normal of a followed lobe.
EG_INLINE Int choose_lobe(const PerfectLobes& lobes, const LobeSum& sum, Mask active, Float u,
                          Float& probability, Vec3& half) {
    Int event = splat(kEventEnds);
    Mask left = active & (sum.value > 0.0f);
    const Float least = kLeastChoice / max(sum.count, 1.0f);
    Float passed = splat(0.0f);
    for (int k = 0; k < kPerfectLobes; ++k) {
        const Float value = lobes.value[k];
        const Float share =
            select(value > 0.0f, least + (1.0f - kLeastChoice) * value / max(sum.value, 1e-30f), splat(0.0f));
        // The last lobe gets the remainder that rounding leaves.
        const Mask picked = left & (value > 0.0f) & ((u < passed + share) | (passed + share > 0.99999f));
        event = select(picked, splat(kPerfectEvent[k]) | (lobes.followed[k] & kEventFollows), event);
        probability = select(picked, probability * share * lobes.density[k], probability);
        half = select(picked, lobes.half[k], half);
        left &= ~picked;
        passed = passed + share;
    }
    return event;
}

// The probability of going on to a light, at surfaces that also have perfect lobes, and at those that scatter
// such light by the tails of followed lobes alone.
constexpr float kLitShare = 0.5f, kTailShare = 0.1f;

// Chooses the event at a surface. The ray passes with a probability by its transparent fraction. Otherwise it
// goes on to a light, if lobes other than perfect ones can reflect it, or scatters by a perfect or followed
// lobe with a probability by the lobe's value. Sets `half` to the microfacet normal of a followed lobe.
EG_OUTLINE Int choose_event(const SceneView& scene, const ChainSurface& s, Mask active, Mask scatters,
                            Mask may_be_lit, UInt stream, int level, Float& probability, Vec3& half) {
    Int event = splat(kEventEnds);
    Mask left = active;
    // Pass with the probability of the transparent fraction
    const Mask may_pass = active & (s.transparency > 0.0f);
    if (any(may_pass)) {
        const Float chance = select(s.transparency >= 1.0f, splat(1.0f),
                                    clamp(s.transparency, splat(kLeastChoice), splat(1.0f - kLeastChoice)));
        const Mask pass = may_pass & (chain_random(stream, level, 1) < chance);
        event = select(pass, splat(kEventPasses), event);
        probability = probability * select(pass, chance, select(may_pass, 1.0f - chance, splat(1.0f)));
        left &= ~pass;
    }
    // Go on to a light from surfaces without perfect lobes
    const Mask bends = has(s.shader, kHasGlossy | kHasRefraction);
    event = select(left & may_be_lit & ~bends, splat(kEventLit), event);
    left &= scatters & bends;
    if (!any(left)) return event;
    const ShadedSurface surface = chain_bsdf(scene, left, s);
    // Evaluate the perfect and followed lobes
    PerfectLobes lobes;
    perfect_values(surface.bsdf, left, lobes);
    if (scene.followed_alpha > 0.0f) {
        Float u, v;
        line_numbers(stream, level, u, v);
        followed_values(surface.bsdf, left, u, v, lobes);
    }
    const LobeSum sum = sum_of(lobes);
    Mask lit = left & may_be_lit;
    // Go on to a light, if there are wide lobes or tails. Wide are also followed lobes whose rays do not meet
    // some lights.
    const Mask tails = lit & (scene.any_tail ? has_followed_lobes(surface.bsdf) : splat(0));
    Bsdf whole = surface.bsdf;
    if (scene.light_followed)
        follow_up_to(whole, splat(scene.lights.kinds & kPointlikeLights ? 0.0f : scene.least_followed));
    const Mask wide = has_wide_lobes(whole, left);
    lit &= wide | tails;
    if (any(lit)) {
        const Float share = select(wide, splat(kLitShare), kTailShare);
        const Float chance = select(sum.value > 0.0f, share, 1.0f);
        const Mask looks = lit & (chain_random(stream, level, 3) < chance);
        event = select(looks, splat(kEventLit), event);
        probability = probability * select(looks, chance, select(lit, 1.0f - chance, splat(1.0f)));
        left &= ~looks;
    }
    left &= sum.value > 0.0f;
    const Int lobe = choose_lobe(lobes, sum, left, chain_random(stream, level, 2), probability, half);
    return select(left, lobe, event);
}

}  // namespace edgegrad::EDGEGRAD_ISA
