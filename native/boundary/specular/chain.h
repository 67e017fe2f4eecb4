// Chains of perfect mirrors, smooth glass and transparent surfaces: the vertices that a camera ray meets one
// after the other, as a function of its place in the picture.
//
// The scattering events at the vertices are chosen at random for one place. Neighbouring places use the same
// events as long as they meet the same surfaces. The chain then varies continuously with the place, except at
// the discontinuities that scan lines search for.
//
// A chain may end at a surface that is not perfectly smooth, with a last ray from there to a light. A
// transparent surface on this ray is a vertex like others, and an opaque one ends the chain.
#pragma once

#include "boundary/specular/chain_light.h"
#include "boundary/specular/chain_surface.h"
#include "path/bounces.h"
#include "path/camera_rays.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Keys of vertices without a region. Vertices on surfaces have the key 2 region + side. kMissed: the ray
// leaves the scene. kDead: there is no ray, because the event scatters no light. kBelow: there is none,
// because the direction is below the horizon of its face. kBlocked: an opaque surface blocks the ray to the
// light.
enum ChainKey : int32_t { kMissed = -1, kDead = -2, kBlocked = -3, kBelow = -4 };

// A place in the picture and on the lens.
struct PicturePoint {
    Float x, y, lens_u, lens_v;
};

// The scattering events of a chain, and the keys of the vertices at which they were chosen.
struct ChainChoices {
    Int key[kMostChain], instance[kMostChain];  // of the vertices at which the events were chosen
    Int closure[kMostChain], event[kMostChain];
    Vec3 half[kMostChain];          // microfacet normals of followed lobes
    Float probability[kMostChain];  // of the event at this vertex
    Int lit;                        // the vertex from which the last ray goes to a light; kMostChain: none
    ChainLight light;
};

// The vertices of a chain: those that agree with its events' keys, and the first that differs.
struct SpecularChain {
    Int count;
    Int key[kMostChain], face[kMostChain], mesh[kMostChain], instance[kMostChain];
    Float b1[kMostChain], b2[kMostChain];
    Vec3 from[kMostChain];       // the vertex that last scattered the ray
    Vec3 direction[kMostChain];  // of the ray, unit
    Vec3 position[kMostChain], normal[kMostChain], smooth[kMostChain];
    Int lights[kMostChain];  // which lights of the table the ray meets (lights_on_way)
};

EG_INLINE ChainRay chain_start(const CameraView& camera, const PicturePoint& at, Float& near, Float& far) {
    const CameraRay ray = camera_ray(camera, at.x, at.y, at.lens_u, at.lens_v);
    const Float length = sqrt(dot(ray.direction, ray.direction));
    near = length * camera.clip_start, far = length * camera.clip_end;
    const Int kind = select(in_disc(camera, at.x, at.y), splat(kCameraRay), splat(kUnseenRay));
    return {ray.origin, ray.direction * (1.0f / length), ray.origin, kind, {}};
}

// The bounces of a chain so far, counted as by the path tracer.
struct ChainCount {
    PathPacket p;
    ImageTask limits;

    ChainCount(const BounceLimits& most, int max_depth) : p{}, limits{} {
        limits.max_depth = max_depth;
        limits.limits = most;
        p.segment = splat(1);
        p.final_ray = splat(max_depth <= 1 ? -1 : 0);
    }
    EG_INLINE void add(Mask scattered, Int kind) {
        const Int counted = select(scattered, kind, splat(kDiffuseRay));
        const Mask last = next_is_final(limits, p, counted);
        p.final_ray = select(scattered, last, p.final_ray);
        p.bounces = add_bounce(p.bounces, scattered, counted);
        p.segment = p.segment + (scattered & 1);
    }
    // Transparent surfaces have the fourth counter. The chain ends at the limit.
    EG_INLINE Mask may_pass() const {
        return bounce_count(p.bounces, splat(kShadowRay)) < limits.limits.transparent;
    }
    EG_INLINE void add_passed(Mask passed) { p.bounces = add_bounce(p.bounces, passed, splat(kShadowRay)); }
};

// Lanes whose surface may have a shader with one of these flags.
EG_INLINE Mask may_have(const SceneView& scene, const SurfacePoint& x, Mask active, int32_t flags) {
    Mask may = splat(0);
    for (int i = 0; i < W; ++i)
        if (active[i] && material_has(scene, x.material[i], flags)) may[i] = -1;
    return may;
}

// A number that says which sized lights of the table meet a ray of `from_mesh` before the distance `far`.
EG_OUTLINE Int lights_on_way(const SceneView& scene, Mask active, const ChainRay& ray, Int from_mesh,
                             Float far, Int bounces) {
    Int sum = splat(0);
    const Float near = length_of(ray.origin - ray.from);
    for_each_met_light(
        scene, active, ray.from, from_mesh, ray.direction, near, near + far, ray.kind, bounces,
        [&](int row, Mask seen, const LightRow&, Float, Float) EG_INLINE_LAMBDA {
            sum = sum + select(seen & (share_of_row(scene, row, ray.lobe) > 0.0f),
                               splat(static_cast<int>(hash(static_cast<uint32_t>(row) + 1u) >> 1)), splat(0));
        });
    return select(active, sum, splat(0));
}

// Directs the rays of lanes `lit` from x to their lights.
EG_OUTLINE void look_at_light(const SceneView& scene, Mask lit, const ChainLight& light,
                              const SurfacePoint& x, ChainRay& ray, Float& far) {
    const ChainLightRay seen = see_chain_light(scene, lit, light, x.position);
    ray.origin = select(lit, leave_surface(x, seen.w), ray.origin);
    ray.direction = select(lit, seen.w, ray.direction);
    ray.from = select(lit, x.position, ray.from);
    far = select(lit, seen.distance * 0.9999f, far);
}

// Traces chains. With kChoose the events are chosen on the way and written to `choices`. Otherwise they are
// read from `choices`.
template <bool kChoose>
EG_OUTLINE void trace_chain(const SceneView& scene, const ScanTask& task, Mask active, const PicturePoint& at,
                            UInt stream, ChainChoices& choices, SpecularChain& chain) {
    chain.count = splat(0);
    if constexpr (kChoose) choices.lit = splat(kMostChain);
    ChainCount counted(task.limits, task.max_depth);
    Float near, far;
    ChainRay ray = chain_start(scene.camera, at, near, far);
    Mask going = active, dead = splat(0), below = dead, bent = dead;
    Int from_mesh = splat(0), bounces = splat(-1);  // before the last one
    for (int level = 0; level < kMostChain && any(going); ++level) {
        const Mask tracing = going & ~dead, to_light = level > choices.lit;
        // Trace the rays to their next surfaces
        Closest hit = intersect(scene, tracing, ray.origin, ray.direction, near, far, ignore_nothing(),
                                level == 0 ? embree::kCoherent : embree::kIncoherent,
                                select(to_light, choices.light.blockers, ray_mask(ray.kind)));
        near = splat(0.0f);
        hit.hit &= tracing;
        SurfacePoint x = hit_surface(scene, hit.hit, hit, ray.direction);
        // Compute the key of the vertex and store the vertex
        const Int region = gather(task.region, select(hit.hit, hit.face, splat(0)));
        Int key = select(hit.hit, 2 * region + ((x.side < 0.0f) & 1),
                         select(below, splat(kBelow), select(dead, splat(kDead), splat(kMissed))));
        const Mask stops = hit.hit & to_light & ~may_have(scene, x, hit.hit & to_light, kHasTransparency);
        key = select(stops, splat(kBlocked), key);
        chain.count = chain.count - going;
        chain.key[level] = key;
        chain.face[level] = hit.face, chain.mesh[level] = hit.mesh, chain.instance[level] = hit.instance;
        chain.b1[level] = hit.b1, chain.b2[level] = hit.b2;
        chain.from[level] = ray.from, chain.direction[level] = ray.direction;
        chain.position[level] = x.position;
        chain.lights[level] = splat(0);
        const Mask shown = tracing & bent & ~to_light;
        if (task.outlines && any(shown))
            chain.lights[level] =
                lights_on_way(scene, shown, ray, from_mesh,
                              select(hit.hit, hit.distance, splat(__builtin_inff())), bounces);
        const TexturePoint point = texture_point(scene, x, -ray.direction, ray.kind);
        chain.normal[level] = x.normal, chain.smooth[level] = point.normal;
        // Stop where the vertex differs from that of the events
        if constexpr (kChoose) {
            choices.key[level] = key, choices.instance[level] = hit.instance;
            choices.closure[level] = splat(0), choices.event[level] = splat(kEventEnds);
            choices.probability[level] = splat(1.0f);
            choices.half[level] = point.normal;
        } else {
            going &= (key == choices.key[level]) & (hit.instance == choices.instance[level]) &
                     (choices.event[level] != kEventEnds);
        }
        going &= hit.hit & x.active & ~stops;
        // Find what may happen at the surface. On the way to a light, chains only pass transparent surfaces.
        // Most other chains end here, at a surface that neither bends their ray nor can be lit.
        const Mask passes_on = going & to_light;
        if constexpr (kChoose)
            choices.event[level] = select(passes_on, splat(kEventPasses), splat(kEventEnds));
        // Light from a surface needs one more ray than light from a light.
        const Mask ends_here = going & bent & ~to_light & ~counted.p.final_ray;
        const Mask by_lights = task.lights ? ends_here : splat(0);
        const Mask by_surfaces =
            task.surfaces ? ends_here & (counted.p.segment + 2 <= task.max_depth) : splat(0);
        const Mask may_be_lit = by_lights | by_surfaces;
        if constexpr (kChoose)
            going &= passes_on | may_be_lit |
                     may_have(scene, x, going, kHasGlossy | kHasRefraction | kHasTransparency);
        if (!any(going)) return;

        // Continue the rays that pass on their way to a light
        ray.origin = select(passes_on, leave_surface(x, ray.direction), ray.origin);
        far = select(passes_on, far - hit.distance, far);
        x.active &= going & ~passes_on;
        const Mask meets = going & ~passes_on;
        if (!any(meets)) continue;
        // Choose a closure and an event at the other surfaces
        Int closure = choices.closure[level];
        Float probability = splat(1.0f);
        if constexpr (kChoose) {
            Float sum;
            closure = pick_closure(scene, x, point, chain_random(stream, level, 0), sum);
            probability = 1.0f / max(sum, 1e-30f);  // times its weight, below
        }
        const ChainSurface s = chain_surface(scene, x, point, select(meets, closure, splat(0)));
        Int event = choices.event[level];
        Vec3 half = choices.half[level];
        if constexpr (kChoose) {
            probability = select(s.closure_weight > 0.0f, probability * s.closure_weight, probability);
            event = choose_event(scene, s, meets, meets & ~counted.p.final_ray, may_be_lit, stream, level,
                                 probability, half);
            event = select((event == kEventPasses) & ~counted.may_pass(), splat(kEventEnds), event);
            const Mask looks = meets & (event == kEventLit);
            if (any(looks)) {
                const Float random[4] = {
                    chain_random(stream, kMostChain, 0), chain_random(stream, kMostChain, 1),
                    chain_random(stream, kMostChain, 2), chain_random(stream, kMostChain, 3)};
                ChainLight light;
                const Mask found =
                    choose_chain_light(scene, scattering_point(scene, looks, s), looks & by_lights,
                                       looks & by_surfaces, bounces_before(counted.p), stream, random,
                                       chain_random(stream, kMostChain + 1, 0), light);
                choices.lit = select(found, splat(level), choices.lit);
                choices.light = select(found, light, choices.light);
                event = select(looks & ~found, splat(kEventEnds), event);
            }
            choices.closure[level] = select(meets, closure, splat(0));
            choices.event[level] = select(meets, event, choices.event[level]);
            choices.probability[level] = select(meets, probability, 1.0f);
            choices.half[level] = half;
            going &= passes_on | (event != kEventEnds);
            if (!any(going)) return;
        }
        // Direct the last rays to their lights
        const Mask lit = meets & going & (event == kEventLit);
        if (any(lit)) look_at_light(scene, lit, choices.light, x, ray, far);
        // Pass or scatter the other rays
        const Mask passes = meets & going & (event == kEventPasses),
                   scatters = meets & going & ~passes & ~lit;
        far = select(passes | scatters, splat(__builtin_inff()), far);
        ray.origin = select(passes, leave_surface(x, ray.direction), ray.origin);
        if (any(scatters)) {
            Vec3 value;
            Mask cut;
            const Mask fine = scatter_chain(scene, s, scatters, event, half, ray, value, cut);
            dead |= scatters & ~fine;
            below |= cut;
            bent |= scatters;
            from_mesh = select(scatters, x.mesh, from_mesh);
            bounces = bounces - scatters;
        }
        if constexpr (kChoose) {
            counted.add(scatters, ray.kind);
            counted.add_passed(passes);
        }
    }
}

// Lanes in which two chains of the same events differ discontinuously at a vertex. Vertices of one region
// differ if one part of the region occludes another: then the vector between both points is not tangential to
// the surface, or the normal is discontinuous.
EG_INLINE Mask surfaces_differ(const SpecularChain& a, const SpecularChain& b, int level) {
    constexpr float kSteep = 0.5f, kBent = 0.7f, kRounding = 4e-6f;
    const Mask other =
        (a.key[level] != b.key[level]) | ((a.key[level] >= 0) & (a.instance[level] != b.instance[level]));
    const Vec3 way = b.position[level] - a.position[level];
    const Float distance = sqrt(dot(way, way));
    const Float off = max(abs(dot(way, a.normal[level])), abs(dot(way, b.normal[level])));
    const Mask fold = (off > kSteep * distance + kRounding * largest_component(a.position[level])) |
                      (dot(a.smooth[level], b.smooth[level]) < kBent);
    return other | ((a.key[level] >= 0) & fold);
}

// The first vertex at which two chains of the same events differ discontinuously, or before which their rays
// meet other lights of the table; -1 if there is none.
EG_OUTLINE Int first_difference(const SpecularChain& a, const SpecularChain& b, Mask active) {
    Int found = splat(-1);
    Mask looking = active;
    for (int level = 0; level < kMostChain; ++level) {
        looking &= (level < a.count) & (level < b.count);
        if (!any(looking)) break;
        const Mask differs = looking & (surfaces_differ(a, b, level) | (a.lights[level] != b.lights[level]));
        found = select(differs, splat(level), found);
        looking &= ~differs;
    }
    return found;
}

}  // namespace edgegrad::EDGEGRAD_ISA
