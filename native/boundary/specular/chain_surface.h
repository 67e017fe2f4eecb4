// Surfaces that a chain of perfect mirrors, smooth glass and transparent surfaces meets, and what becomes of
// its ray there: the fate that is chosen for it. Lobes that are followed are mirrors and glass of a random
// normal, which belongs to the fate (shading/bsdf/followed_lobes.h).
#pragma once

#include "path/shaded_surface.h"
#include "path/stream.h"
#include "shading/bsdf/perfect_lobes.h"
#include "tasks/scan_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Fates: a lobe, which may transmit, and may be followed; to pass unscattered; to look from here at a light
// (boundary/specular/chain_light.h); to end here.
constexpr int32_t kEventLobes = 7, kEventTransmits = 8, kEventPasses = 16, kEventLit = 32, kEventFollows = 64,
                  kEventEnds = -1;

// A ray of a chain.
struct ChainRay {
    Vec3 origin, direction, from;
    Int kind;
};
EG_INLINE ChainRay select(Mask m, const ChainRay& a, const ChainRay& b) {
    return {select(m, a.origin, b.origin), select(m, a.direction, b.direction), select(m, a.from, b.from),
            select(m, a.kind, b.kind)};
}

// Perfect and followed lobes that a surface may have.
constexpr int kPerfectLobes = 4;
constexpr int32_t kPerfectEvent[kPerfectLobes] = {kMirrorLobe, kCoatLobe, kInterfaceLobe,
                                                  kInterfaceLobe | kEventTransmits};

struct PerfectLobes {
    // Their values f |cos| at the view, zero of those that it hasn't; of followed ones by the density of the
    // microfacet's normal, which is that by D(h) dh.
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
        put(0, (f.probability[kMirrorLobe] > 0.0f) & is_smooth(f.mirror.ggx), reflectance(f.mirror, cosine));
    if (f.any_lobe[kCoatLobe])
        put(1, (f.probability[kCoatLobe] > 0.0f) & is_smooth(f.coat.ggx), reflectance(f.coat, cosine));
    if (f.any_lobe[kInterfaceLobe]) {
        const Mask has = f.probability[kInterfaceLobe] > 0.0f;
        const Split s = split_light(f.glass, cosine);
        put(2, has & is_smooth(f.glass.ggx), s.reflected);
        put(3, has & refracts_smoothly(f.glass), s.transmitted);
    }
}

// Adds followed lobes, their normals by the random numbers u and v.
EG_OUTLINE void followed_values(const Bsdf& f, Mask active, Float u, Float v, PerfectLobes& lobes) {
    const auto put = [&](int k, const Ggx& g, Vec3 view, bool transmits) {
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
    if (f.any_lobe[kMirrorLobe]) put(0, f.mirror.ggx, f.turned_view, false);
    if (f.any_lobe[kCoatLobe]) put(1, f.coat.ggx, f.view, false);
    if (f.any_lobe[kInterfaceLobe]) put(2, f.glass.ggx, f.view, false), put(3, f.glass.ggx, f.view, true);
}

// A surface that a chain meets, and what it does with the ray.
struct ChainSurface {
    SurfacePoint x;
    TexturePoint point;
    Shader shader;
    Float closure_weight;  // of the shader in its material
    Float share;           // of light that passes unscattered
    Vec3 passing;          // its colour
};

EG_OUTLINE ChainSurface chain_surface(const SceneView& scene, const SurfacePoint& x,
                                      const TexturePoint& point, Int closure) {
    ChainSurface s{x, point, closure_shader(scene, x, closure, point), splat(1.0f), splat(0.0f), zero3()};
    if (scene.any_mixture) {
        const Int first = gather(scene.material_first_closure, x.material);
        const Mask mixed = x.active & (gather(scene.material_first_closure + 1, x.material) - first > 1);
        if (any(mixed))
            s.closure_weight = select(mixed, closure_weight(scene, mixed, closure, point), s.closure_weight);
    }
    if (scene.all_flags & kHasTransparency) s.share = passing_share(s.shader, s.passing);
    return s;
}

EG_OUTLINE ShadedSurface chain_bsdf(const SceneView& scene, Mask active, const ChainSurface& s) {
    const Vec3 normal = shading_normal(scene, active, s.shader, s.point);
    ShadedSurface surface = shaded_surface(scene, active, s.x, s.point, s.shader, normal);
    if (scene.followed_alpha > 0.0f) follow_lobes(surface.bsdf, active, scene.followed_alpha);
    return surface;
}

// The rays of lanes that scatter by the lobe of their fate.
EG_OUTLINE Specular scatter_by_event(const SceneView& scene, const ChainSurface& s, Mask scatters, Int event,
                                     Mask transmitted, Vec3 half) {
    const Shader& shader = s.shader;
    const Mask followed = scatters & ((event & kEventFollows) != 0);
    if (!(scene.all_flags & kHasNormalMap) && !any(followed) &&
        !any(scatters & ~scatters_plainly(shader.kind, shader.flags)))
        return scatter_plainly(
            plain_interface(shader.kind, shader.color(kBaseColor), shader.row[kIor], s.x.side < 0.0f),
            valid_mirror_normal(s.point.normal, s.x.normal, s.point.view), s.point.view, event & kEventLobes,
            transmitted);
    const ShadedSurface surface = chain_bsdf(scene, scatters, s);
    Specular next = scatter_specular(surface.bsdf, event & kEventLobes, transmitted, followed, half);
    if (surface.smooth)
        next.value = next.value * bump_shadowing(*surface.smooth, surface.normal, next.wi, surface.diffuse);
    return next;
}

// Where lanes that scatter go on, what it multiplies their light with, and whether there is such a direction.
// `below`: it is on the wrong side of the face, which interpolated normals may lead to.
EG_OUTLINE Mask scatter_chain(const SceneView& scene, const ChainSurface& s, Mask scatters, Int event,
                              Vec3 half, ChainRay& ray, Vec3& value, Mask& below) {
    const Mask transmitted = (event & kEventTransmits) != 0;
    const Specular next = scatter_by_event(scene, s, scatters, event, transmitted, half);
    value = next.value;
    const Float side = dot(s.x.normal, next.wi);
    const Mask shines = scatters & (largest_component(value) > 0.0f);
    const Mask fine = shines & select(transmitted, side < 0.0f, side > 0.0f);
    below = shines & ~fine;
    ray.origin = select(scatters, leave_surface(s.x, next.wi), ray.origin);
    ray.direction = select(scatters, next.wi, ray.direction);
    ray.from = select(scatters, s.x.position, ray.from);
    ray.kind = select(
        scatters,
        select(transmitted, splat(static_cast<int>(kTransmissionRay)), splat(static_cast<int>(kGlossyRay))),
        ray.kind);
    return fine;
}

// Numbers in [0, 1) for a vertex' choices.
EG_INLINE Float chain_random(UInt stream, int level, int which) {
    const uint32_t place =
        hash(static_cast<uint32_t>(4 * level + (which & 3)) ^ (which < 4 ? 0x7f4a7c15u : 0x2545f491u));
    return to_float(bits(hash(stream ^ splat(place)) >> 8)) * 5.9604645e-8f;
}

// Least probability of what is possible at all, by the number of possibilities.
constexpr float kLeastChoice = 0.1f;

// Lanes with a lobe that is neither perfect nor followed.
EG_INLINE Mask has_wide_lobes(const Bsdf& f, Mask active) {
    Mask wide = splat(0);
    for (int k = 0; k < kLobes; ++k) {
        if (!f.any_lobe[k]) continue;
        const Mask perfect = k == kMirrorLobe      ? is_perfect(f.mirror.ggx)
                             : k == kCoatLobe      ? is_perfect(f.coat.ggx)
                             : k == kInterfaceLobe ? is_perfect(f.glass.ggx)
                                                   : splat(0);
        wide |= active & (f.probability[k] > 0.0f) & ~perfect;
    }
    return wide;
}

// Share of fates that look at a light, of surfaces that have perfect lobes besides.
constexpr float kLitShare = 0.5f;

// Chooses a fate at a surface: to pass in proportion to what passes, else to look at a light, if other lobes
// than perfect ones show it, or one of the perfect and followed lobes in proportion to their values. `half`:
// the microfacet's normal of the latter.
EG_OUTLINE Int choose_event(const SceneView& scene, const ChainSurface& s, Mask active, Mask scatters,
                            Mask may_be_lit, UInt stream, int level, Float& probability, Vec3& half) {
    Int event = splat(kEventEnds);
    Mask left = active;
    const Mask may_pass = active & (s.share > 0.0f);
    if (any(may_pass)) {
        const Float chance = select(s.share >= 1.0f, splat(1.0f),
                                    clamp(s.share, splat(kLeastChoice), splat(1.0f - kLeastChoice)));
        const Mask pass = may_pass & (chain_random(stream, level, 1) < chance);
        event = select(pass, splat(kEventPasses), event);
        probability = probability * select(pass, chance, select(may_pass, 1.0f - chance, splat(1.0f)));
        left &= ~pass;
    }
    const Mask bends = has(s.shader, kHasGlossy | kHasRefraction);
    event = select(left & may_be_lit & ~bends, splat(kEventLit), event);
    left &= scatters & bends;
    if (!any(left)) return event;
    const ShadedSurface surface = chain_bsdf(scene, left, s);
    Float sum = splat(0.0f), count = splat(0.0f);
    PerfectLobes lobes;
    perfect_values(surface.bsdf, left, lobes);
    if (scene.followed_alpha > 0.0f)
        followed_values(surface.bsdf, left, chain_random(stream, level, 4), chain_random(stream, level, 5),
                        lobes);
    for (const Float& v : lobes.value) {
        sum = sum + v;
        count = count + select(v > 0.0f, splat(1.0f), 0.0f);
    }
    Mask lit = left & may_be_lit;
    // Followed lobes scatter light of the table as wide ones do.
    const bool table = scene.lights.kinds & ~(1 << kTriangleLight);
    Bsdf whole = surface.bsdf;
    if (table) follow_none(whole, left);
    lit &= has_wide_lobes(whole, left);
    if (any(lit)) {
        const Float chance = select(sum > 0.0f, splat(kLitShare), 1.0f);
        const Mask looks = lit & (chain_random(stream, level, 3) < chance);
        event = select(looks, splat(kEventLit), event);
        probability = probability * select(looks, chance, select(lit, 1.0f - chance, splat(1.0f)));
        left &= ~looks;
    }
    left &= sum > 0.0f;
    const Float u = chain_random(stream, level, 2), least = kLeastChoice / max(count, 1.0f);
    Float passed = splat(0.0f);
    for (int k = 0; k < kPerfectLobes; ++k) {
        const Float value = lobes.value[k];
        const Float share =
            select(value > 0.0f, least + (1.0f - kLeastChoice) * value / max(sum, 1e-30f), splat(0.0f));
        // The last one takes what rounding leaves.
        const Mask picked = left & (value > 0.0f) & ((u < passed + share) | (passed + share > 0.99999f));
        event = select(picked, splat(kPerfectEvent[k]) | (lobes.followed[k] & kEventFollows), event);
        probability = select(picked, probability * share * lobes.density[k], probability);
        half = select(picked, lobes.half[k], half);
        left &= ~picked;
        passed = passed + share;
    }
    return event;
}

}  // namespace edgegrad::EDGEGRAD_ISA
