// Chains of perfect mirrors, smooth glass and transparent surfaces: what a camera ray meets one after the
// other, as a function of its place in the picture.
//
// What becomes of the ray at each surface (its fate) is chosen at random once, for one place; other places
// near by take the same fate for as long as they meet the same surfaces. So all that the chain depends on
// varies continuously from place to place but for the jumps that are looked for.
#pragma once

#include "boundary/scan_task.h"
#include "path/bounces.h"
#include "path/camera_rays.h"
#include "path/shaded_surface.h"
#include "shading/bsdf/specular.h"

namespace edgegrad::EDGEGRAD_ISA {

// What a chain's vertices are told apart by, besides the numbers of regions (2 region + side).
enum ChainKey : int32_t { kMissed = -1, kDead = -2 };

// Fates: a lobe, which may transmit; to pass unscattered; to end here.
constexpr int32_t kFateLobes = 7, kFateTransmits = 8, kFatePasses = 16, kFateEnds = -1;

// A place of the picture and of the lens.
struct PicturePoint {
    Float x, y, lens_u, lens_v;
};

struct ChainChoices {
    Int key[kMostChain], instance[kMostChain];  // of the vertices that it was chosen at
    Int leaf[kMostChain], fate[kMostChain];
    Float probability[kMostChain];  // of this vertex' choice
};

// The vertices that a chain meets: as far as they are those of its choices, and the first that differs.
struct SpecularChain {
    Int count;
    Int key[kMostChain], face[kMostChain], mesh[kMostChain], instance[kMostChain];
    Float b1[kMostChain], b2[kMostChain];
    Vec3 from[kMostChain];       // the vertex that scattered the ray last
    Vec3 direction[kMostChain];  // of the ray, unit
    Vec3 position[kMostChain], normal[kMostChain], smooth[kMostChain];
};

// A ray of a chain.
struct ChainRay {
    Vec3 origin, direction, from;
    Int kind;
};

EG_INLINE ChainRay chain_start(const CameraView& camera, const PicturePoint& at, Float& near, Float& far) {
    const CameraRay ray = camera_ray(camera, at.x, at.y, at.lens_u, at.lens_v);
    const Float length = sqrt(dot(ray.direction, ray.direction));
    near = length * camera.clip_start, far = length * camera.clip_end;
    return {ray.origin, ray.direction * (1.0f / length), ray.origin, splat(static_cast<int>(kCameraRay))};
}

// Perfect lobes that a surface may have: their values f |cos| at the view, zero of those that it hasn't.
constexpr int kPerfectLobes = 4;
constexpr int32_t kPerfectFate[kPerfectLobes] = {kMirrorLobe, kCoatLobe, kInterfaceLobe,
                                                 kInterfaceLobe | kFateTransmits};

EG_INLINE void perfect_values(const Bsdf& f, Mask active, Float (&value)[kPerfectLobes]) {
    for (Float& v : value) v = splat(0.0f);
    const Float cosine = f.view.z;
    const auto put = [&](int k, Mask m, Vec3 v) { value[k] = select(active & m, average(v), splat(0.0f)); };
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

// A surface that a chain meets, and what it does with the ray.
struct ChainSurface {
    SurfacePoint x;
    TexturePoint point;
    Shader shader;
    Float leaf_weight;  // of the shader in its material
    Float share;        // of light that passes unscattered
    Vec3 passing;       // its colour
};

EG_OUTLINE ChainSurface chain_surface(const SceneView& scene, const SurfacePoint& x,
                                      const TexturePoint& point, Int leaf) {
    ChainSurface s{x, point, leaf_shader(scene, x, leaf, point), splat(1.0f), splat(0.0f), zero3()};
    if (scene.any_mixture) {
        const Int first = gather(scene.material_first_leaf, x.material);
        const Mask mixed = x.active & (gather(scene.material_first_leaf + 1, x.material) - first > 1);
        if (any(mixed)) s.leaf_weight = select(mixed, leaf_weight(scene, mixed, leaf, point), s.leaf_weight);
    }
    if (scene.all_flags & kHasTransparency) s.share = passing_share(s.shader, s.passing);
    return s;
}

EG_OUTLINE ShadedSurface chain_bsdf(const SceneView& scene, Mask active, const ChainSurface& s) {
    Vec3 normal = s.point.normal;
    if (scene.all_flags & kHasNormalMap)
        normal = shading_normal(scene, active & has(s.shader, kHasNormalMap), s.shader.leaf, s.point,
                                s.shader.color(kNormalMap), s.shader.row[kNormalStrength]);
    return shaded_surface(scene, active, s.x, s.point, s.shader, normal);
}

// Where lanes that scatter go on, what it multiplies their light with, and whether there is such a direction.
EG_OUTLINE Mask scatter_chain(const ChainSurface& s, const ShadedSurface& surface, Mask scatters, Int fate,
                              ChainRay& ray, Vec3& value) {
    const Mask transmitted = (fate & kFateTransmits) != 0;
    const Specular next = scatter_specular(surface.bsdf, fate & kFateLobes, transmitted);
    value = next.value;
    if (surface.smooth)
        value = value * bump_shadowing(*surface.smooth, surface.normal, next.wi, surface.diffuse);
    const Float side = dot(s.x.normal, next.wi);
    const Mask fine =
        scatters & select(transmitted, side < 0.0f, side > 0.0f) & (largest_component(value) > 0.0f);
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
    const uint32_t place = hash(static_cast<uint32_t>(4 * level + which) ^ 0x7f4a7c15u);
    return to_float(bits(hash(stream ^ splat(place)) >> 8)) * 5.9604645e-8f;
}

// Least probability of what is possible at all, by the number of possibilities.
constexpr float kLeastChoice = 0.1f;

// Chooses a fate at a surface: to pass in proportion to what passes, else one of the perfect lobes in
// proportion to their values.
EG_OUTLINE Int choose_fate(const SceneView& scene, const ChainSurface& s, Mask active, Mask scatters,
                           UInt stream, int level, Float& probability) {
    Int fate = splat(kFateEnds);
    Mask left = active;
    const Mask may_pass = active & (s.share > 0.0f);
    if (any(may_pass)) {
        const Float chance = select(s.share >= 1.0f, splat(1.0f),
                                    clamp(s.share, splat(kLeastChoice), splat(1.0f - kLeastChoice)));
        const Mask pass = may_pass & (chain_random(stream, level, 1) < chance);
        fate = select(pass, splat(kFatePasses), fate);
        probability = probability * select(pass, chance, select(may_pass, 1.0f - chance, splat(1.0f)));
        left &= ~pass;
    }
    left &= scatters & has(s.shader, kHasGlossy | kHasRefraction);
    if (!any(left)) return fate;
    const ShadedSurface surface = chain_bsdf(scene, left, s);
    Float value[kPerfectLobes], sum = splat(0.0f), count = splat(0.0f);
    perfect_values(surface.bsdf, left, value);
    for (const Float& v : value) {
        sum = sum + v;
        count = count + select(v > 0.0f, splat(1.0f), 0.0f);
    }
    left &= sum > 0.0f;
    const Float u = chain_random(stream, level, 2), least = kLeastChoice / max(count, 1.0f);
    Float passed = splat(0.0f);
    for (int k = 0; k < kPerfectLobes; ++k) {
        const Float share =
            select(value[k] > 0.0f, least + (1.0f - kLeastChoice) * value[k] / max(sum, 1e-30f), splat(0.0f));
        // The last one takes what rounding leaves.
        const Mask picked = left & (value[k] > 0.0f) & ((u < passed + share) | (passed + share > 0.99999f));
        fate = select(picked, splat(kPerfectFate[k]), fate);
        probability = select(picked, probability * share, probability);
        left &= ~picked;
        passed = passed + share;
    }
    return fate;
}

// Bounces of a chain so far, as paths count them.
struct ChainCount {
    PathPacket p;
    ImageTask limits;

    explicit ChainCount(const BounceLimits& most, int max_depth) : p{}, limits{} {
        limits.max_depth = max_depth;
        limits.limits = most;
        p.segment = splat(1);
        p.final_ray = splat(max_depth <= 1 ? -1 : 0);
    }
    EG_INLINE void add(Mask scattered, Int kind) {
        const Int counted = select(scattered, kind, splat(static_cast<int>(kDiffuseRay)));
        const Mask last = next_is_final(limits, p, counted);
        p.final_ray = select(scattered, last, p.final_ray);
        p.bounces = add_bounce(p.bounces, scattered, counted);
        p.segment = p.segment + (scattered & 1);
    }
    // Surfaces that were gone through are counted by the fourth count; those beyond the limit end the chain.
    EG_INLINE Mask may_pass() const {
        return bounce_count(p.bounces, splat(static_cast<int>(kShadowRay))) < limits.limits.transparent;
    }
    EG_INLINE void add_passed(Mask passed) {
        p.bounces = add_bounce(p.bounces, passed, splat(static_cast<int>(kShadowRay)));
    }
};

// Lanes whose surface may have a shader that is a mirror or lets light through.
EG_INLINE Mask sends_on(const SceneView& scene, const SurfacePoint& x, Mask active) {
    Mask may = splat(0);
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const int32_t first = scene.material_first_leaf[x.material[i]],
                      last = scene.material_first_leaf[x.material[i] + 1];
        for (int32_t leaf = first; leaf < last; ++leaf)
            if (scene.leaf_flags[leaf] & (kHasGlossy | kHasRefraction | kHasTransparency)) may[i] = -1;
    }
    return may;
}

// Traces chains. kChoose: `choices` are made on the way, else followed.
template <bool kChoose>
EG_OUTLINE void trace_chain(const SceneView& scene, const ScanTask& task, const BounceLimits& limits,
                            int max_depth, Mask active, const PicturePoint& at, UInt stream,
                            ChainChoices& choices, SpecularChain& chain) {
    chain.count = splat(0);
    ChainCount counted(limits, max_depth);
    Float near, far;
    ChainRay ray = chain_start(scene.camera, at, near, far);
    Mask going = active, dead = splat(0);
    for (int level = 0; level < kMostChain && any(going); ++level) {
        const Mask tracing = going & ~dead;
        Closest hit = intersect(scene, tracing, ray.origin, ray.direction, near, far, ignore_nothing(),
                                level == 0 ? embree::kCoherent : embree::kIncoherent, ray_mask(ray.kind));
        near = splat(0.0f), far = splat(__builtin_inff());
        hit.hit &= tracing;
        SurfacePoint x = surface_point(scene, hit.hit, hit.face, hit.b1, hit.b2, ray.direction, hit.instance);
        x.mesh = hit.mesh;
        const Int region = gather(task.region, select(hit.hit, hit.face, splat(0)));
        const Int key =
            select(hit.hit, 2 * region + ((x.side < 0.0f) & 1),
                   select(dead, splat(static_cast<int>(kDead)), splat(static_cast<int>(kMissed))));
        chain.count = chain.count - going;
        chain.key[level] = key;
        chain.face[level] = hit.face, chain.mesh[level] = hit.mesh, chain.instance[level] = hit.instance;
        chain.b1[level] = hit.b1, chain.b2[level] = hit.b2;
        chain.from[level] = ray.from, chain.direction[level] = ray.direction;
        chain.position[level] = x.position;
        chain.normal[level] = chain.smooth[level] = x.normal;
        if constexpr (kChoose) {
            choices.key[level] = key, choices.instance[level] = hit.instance;
            choices.leaf[level] = splat(0), choices.fate[level] = splat(kFateEnds);
            choices.probability[level] = splat(1.0f);
        } else {
            going &= (key == choices.key[level]) & (hit.instance == choices.instance[level]) &
                     (choices.fate[level] != kFateEnds);
        }
        going &= hit.hit & x.active;
        if (scene.corner_normal && any(hit.hit)) chain.smooth[level] = smooth_normal(scene, x);
        // Most chains end at a surface that does nothing of the kind.
        if constexpr (kChoose) going &= sends_on(scene, x, going);
        if (!any(going)) return;

        x.active &= going;
        const TexturePoint point = texture_point(scene, x, -ray.direction, ray.kind);
        Int leaf = choices.leaf[level];
        Float probability = splat(1.0f);
        if constexpr (kChoose) {
            Float sum;
            leaf = pick_leaf(scene, x, point, chain_random(stream, level, 0), sum);
            probability = 1.0f / max(sum, 1e-30f);  // times its weight, below
        }
        const ChainSurface s = chain_surface(scene, x, point, select(going, leaf, splat(0)));
        Int fate = choices.fate[level];
        if constexpr (kChoose) {
            probability = select(s.leaf_weight > 0.0f, probability * s.leaf_weight, probability);
            fate = choose_fate(scene, s, going, going & ~counted.p.final_ray, stream, level, probability);
            fate = select((fate == kFatePasses) & ~counted.may_pass(), splat(kFateEnds), fate);
            choices.leaf[level] = select(going, leaf, splat(0));
            choices.fate[level] = select(going, fate, splat(kFateEnds));
            choices.probability[level] = probability;
            going &= fate != kFateEnds;
            if (!any(going)) return;
        }
        const Mask passes = going & (fate == kFatePasses), scatters = going & ~passes;
        ray.origin = select(passes, leave_surface(x, ray.direction), ray.origin);
        if (any(scatters)) {
            const ShadedSurface surface = chain_bsdf(scene, scatters, s);
            Vec3 value;
            const Mask fine = scatter_chain(s, surface, scatters, fate, ray, value);
            dead = scatters & ~fine;
        }
        if constexpr (kChoose) {
            counted.add(scatters, ray.kind);
            counted.add_passed(passes);
        }
    }
}

// The first vertex at which two chains of the same choices differ by more than their neighbourhood explains;
// -1: none. Within one region they do where one part of it hides another: the way from one point to the other
// doesn't lie in the surface then, or the normal jumps.
EG_OUTLINE Int first_difference(const SpecularChain& a, const SpecularChain& b, Mask active) {
    constexpr float kSteep = 0.5f, kBent = 0.7f, kRounding = 4e-6f;
    Int found = splat(-1);
    Mask looking = active;
    for (int level = 0; level < kMostChain; ++level) {
        looking &= (level < a.count) & (level < b.count);
        if (!any(looking)) break;
        const Mask other = (a.key[level] != b.key[level]) | (a.instance[level] != b.instance[level]);
        const Vec3 way = b.position[level] - a.position[level];
        const Float distance = sqrt(dot(way, way));
        const Float off = max(abs(dot(way, a.normal[level])), abs(dot(way, b.normal[level])));
        const Mask fold = (off > kSteep * distance + kRounding * largest_component(a.position[level])) |
                          (dot(a.smooth[level], b.smooth[level]) < kBent);
        const Mask differs = looking & (other | ((a.key[level] >= 0) & fold));
        found = select(differs, splat(level), found);
        looking &= ~differs;
    }
    return found;
}

}  // namespace edgegrad::EDGEGRAD_ISA
