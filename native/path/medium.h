// Scattering in homogeneous media on the way to a hit (shading/media.h). Along a ray that meets its surface
// after the distance D, with the extinction s_t and the scattering s_s,
//   L = int_0^D exp(-s_t t) s_s int p(w, w') L(x_t, w') dw' dt + exp(-s_t D) L(x_D).
// Each path takes one of the two parts: it is scattered at a sampled distance, or passes to its surface.
#pragma once

#include "path/path_queue.h"
#include "path/recorder.h"
#include "path/scatter.h"
#include "path/stream.h"
#include "path/value_recorder.h"
#include "shading/media.h"
#include "shading/phase_function.h"

namespace edgegrad::EDGEGRAD_ISA {

// Least share of the paths through a medium that are scattered: light in thin media is often brighter than
// what lies behind.
constexpr float kLeastScattered = 0.25f;
// Share of these whose distance is sampled near a light.
constexpr float kNearLight = 0.5f;

// Finds the media along rays, which end after `distance`. Rays from the start of boundary samples are only
// attenuated: what media scatter towards them is no part of the edge's light. Returns whether any ray may be
// scattered or must be recorded.
EG_INLINE bool find_media(const SceneView& scene, PathPacket& p, Float distance, bool boundary,
                          RayMedia& media) {
    const Mask seen = p.active & (p.kind != splat(kUnseenRay));
    media = media_along(scene, seen, p.origin, p.direction, distance);
    const Mask dense = seen & media.dense();
    for (Vec3* field : {&media.extinction, &media.scattering, &media.depth})
        *field = select(dense, *field, zero3());
    if (!any(dense)) return false;
    if (!boundary) return true;
    p.throughput = p.throughput * kept_over(media.extinction, distance);
    return false;
}

// Where paths are scattered.
struct MediumEvent {
    Mask scatters;
    Float way;
    Vec3 weight;  // of the scattered light; of the light that passes, in the other lanes
};

// The place of a light along a ray: its foot on the ray, and its distance from there (Kulla and Fajardo
// 2012).
struct LightAlong {
    Mask found;
    Float foot, height;
    Float first, last;  // angles of the ray's ends, seen from the light

    EG_INLINE Float density(Float way) const {
        const Float beyond = way - foot;
        return height / max((last - first) * (height * height + beyond * beyond), 1e-30f);
    }
    EG_INLINE Float sample(Float u) const {
        Float sine, cosine;
        sincos_turn((first + (last - first) * u) * (0.5f * kInvPi), sine, cosine);
        return foot + height * sine / max(cosine, 1e-6f);
    }
};

// Chooses a light that is not distant, in proportion to its importance at the middle of the ray.
EG_INLINE LightAlong light_along(const SceneView& scene, const PathPacket& p, Mask active, Float distance,
                                 const PathIndex& index) {
    const LightView& lights = scene.lights;
    LightAlong along{splat(0), splat(0.0f), splat(1.0f), splat(0.0f), splat(1.0f)};
    if (lights.count == 0) return along;
    const Float u = sobol_pair(index, vertex_pair(p.vertex, kVertexMediumLight)).u;
    const Float middle = select(distance < __builtin_inff(), 0.5f * distance, splat(0.0f));
    const Vec3 normal = -p.direction;
    const SurfaceReceiver receiver{{p.origin + p.direction * middle, normal, splat(-1), nullptr, splat(1.0f)},
                                   splat(-1)};
    const LightChoice choice = choose_light(lights, active, receiver, u);
    const Int kind = gather(lights.kind, choice.light), row = gather(lights.index, choice.light);
    along.found = choice.active & (kind < static_cast<int>(kDirectionLight));
    const Mask triangle = along.found & (kind == static_cast<int>(kTriangleLight));
    const Mask of_table = along.found & ~triangle;
    Vec3 place = zero3();
    if (any(triangle)) {
        const Triangle t = gather_triangle(scene, select(triangle, row, splat(0)));
        place = (t.p0 + t.p1 + t.p2) * splat(1.0f / 3.0f);
    }
    if (any(of_table))
        place = select(of_table, gather_light(lights, select(of_table, row, splat(0))).position, place);
    const Vec3 way = place - p.origin;
    along.foot = dot(way, p.direction);
    const Vec3 aside = way - p.direction * along.foot;
    along.height = sqrt(max(dot(aside, aside), 1e-12f * dot(way, way) + 1e-30f));
    along.first = atan2(-along.foot, along.height);
    along.last =
        select(distance < __builtin_inff(), atan2(distance - along.foot, along.height), splat(1.57079633f));
    return along;
}

// Samples where paths are scattered. The distance follows the transmittance of a channel, chosen by the
// path's throughput, or half of the time the angle that a light sees. The weights are those of the balance
// heuristic (Veach 1997).
EG_INLINE MediumEvent sample_event(const SceneView& scene, const PathPacket& p, Mask may,
                                   const RayMedia& media, Float distance, const PathIndex& index) {
    MediumEvent event{may, distance, one3()};
    const auto [choice, place] = sobol_pair(index, vertex_pair(p.vertex, kVertexMedium));
    // Choose a channel in proportion to the light that it would scatter
    const Float* const extinction[3] = {&media.extinction.x, &media.extinction.y, &media.extinction.z};
    const Float* const scattering[3] = {&media.scattering.x, &media.scattering.y, &media.scattering.z};
    const Float* const throughput[3] = {&p.throughput.x, &p.throughput.y, &p.throughput.z};
    const Float brightest = largest_component(p.throughput);
    Float share[3], lost[3], total = splat(0.0f), chance = splat(0.0f);
    for (int c = 0; c < 3; ++c) {
        share[c] = select(*scattering[c] > 0.0f, *throughput[c] + 0.1f * brightest + 1e-30f, splat(0.0f));
        lost[c] = 1.0f - exp(-select(*extinction[c] > 0.0f, *extinction[c] * distance, splat(0.0f)));
        total = total + share[c];
    }
    for (int c = 0; c < 3; ++c) {
        share[c] = share[c] / max(total, 1e-37f);
        chance = chance + share[c] * lost[c];
    }
    may &= (total > 0.0f) & (chance > 0.0f);
    chance = select(may, max(chance, kLeastScattered), splat(0.0f));
    // Choose between the parts; then the number is uniform again
    event.scatters = may & (choice < chance);
    const Float rest = select(event.scatters, choice / max(chance, 1e-30f), splat(0.0f));
    const LightAlong light = light_along(scene, p, event.scatters, distance, index);
    const Float near_light = select(light.found, splat(kNearLight), splat(0.0f));
    const Mask angular = event.scatters & (rest < near_light);
    Float number = (rest - near_light) / (1.0f - near_light);
    // Sample the distance
    Float way = splat(0.0f);
    for (int c = 0; c < 3; ++c) {
        const Mask here = event.scatters & ~angular & (number >= 0.0f) & (number < share[c]);
        const Float sampled = -log(max(1.0f - place * lost[c], 1e-30f)) / max(*extinction[c], 1e-30f);
        way = select(here, sampled, way);
        number = number - share[c];
    }
    if (any(angular)) way = select(angular, light.sample(place), way);
    way = min(max(way, splat(0.0f)), distance);
    // Divide by the density of all ways to sample this distance
    Float density = splat(0.0f);
    for (int c = 0; c < 3; ++c)
        density = density + share[c] * *extinction[c] * exp(-*extinction[c] * way) / max(lost[c], 1e-30f);
    if (any(light.found)) density = density * (1.0f - near_light) + near_light * light.density(way);
    const Vec3 scattered = media.scattering * kept_over(media.extinction, way);
    event.way = select(event.scatters, way, distance);
    event.weight = select(event.scatters, scattered * (1.0f / max(density * chance, 1e-30f)),
                          kept_over(media.extinction, distance) * (1.0f / max(1.0f - chance, 1e-30f)));
    return event;
}

// Records the rays of a packet in a medium.
EG_INLINE void record_crossing(const SceneView& scene, Vertex& v, const PathPacket& p, Mask dense,
                               const Closest& hit, const RayMedia& media, const MediumEvent& event,
                               Mask touched) {
    PathPacket crossing = p;
    crossing.active = dense;
    record_arrival(scene, v, crossing, hit.hit, hit);
    put(v.face, splat(-1), splat(kInMedium));
    put(v.passes, dense & ~event.scatters, splat(-1));
    put3(v.medium_extinction, dense, media.extinction);
    put3(v.medium_weight, dense, event.weight);
    put(v.medium_way, dense, way_so_far(p) + event.way);
    put(v.medium_cosine, dense, media.cosine());
    store(v.touched, touched);
}

// Scatters a part of the paths in the media along their rays, and removes them from the packet's active
// lanes. Multiplies the throughput of the others. `moving`: derivatives by positions are recorded. Returns
// the queue's new length.
EG_OUTLINE int cross_medium(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket& p,
                            const Closest& hit, const RayMedia& media, bool moving, int alive) {
    const PathIndex index = path_index(task, p.path);
    const Mask dense = p.active & media.dense();
    const Float distance = select(hit.hit, hit.distance, splat(__builtin_inff()));
    const MediumEvent event = sample_event(scene, p, dense & ~p.final_ray, media, distance, index);
    const Mask scatters = dense & event.scatters;
    // Record the event
    Vertex* vertex = nullptr;
    if (work.vertices) {
        vertex = &work.vertices->append<W>();
        record_crossing(scene, *vertex, p, dense, hit, media, event, p.touched);
        keep_touched(*work.vertices, *vertex, moving ? dense : p.touched);
    }
    if (work.values) {
        Values& v = record_values(*work.values, p, dense);
        put3(v.color, dense, event.weight);
        put3(v.next_gain, dense & ~scatters, one3());
        keep_touched(*work.values, v, p.touched);
    }
    // Scatter paths. Sweeps over values multiply by the event's weight themselves.
    PathPacket part = p;
    part.active = scatters;
    p.throughput = select(dense & ~scatters, p.throughput * event.weight, p.throughput);
    p.active &= ~scatters;
    if (!any(scatters)) return alive;
    if (!work.values) part.throughput = part.throughput * event.weight;
    SurfacePoint x;
    x.active = splat(0);
    x.face = x.instance = splat(-1);
    x.b1 = x.b2 = x.length_m = x.offset = splat(0.0f);
    x.side = splat(1.0f);
    x.position = p.origin + p.direction * select(scatters, event.way, splat(0.0f));
    x.normal = -p.direction;
    x.triangle = {x.position, x.position, x.position};
    x.material = splat(0);
    x.mesh = select(hit.hit, hit.mesh, splat(0));
    const PhaseFunction phase{x.normal, p.direction, media.cosine()};
    return scatter(scene, task, work, part, x, phase, index, splat(0.5f), alive, vertex);
}

}  // namespace edgegrad::EDGEGRAD_ISA
