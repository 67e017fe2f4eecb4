// The distance at which a path is scattered in a medium (path/media/crossing.h).
#pragma once

#include "path/path_queue.h"
#include "path/stream.h"
#include "shading/lights/light_samples.h"
#include "shading/media.h"

namespace edgegrad::EDGEGRAD_ISA {

// Least share of the paths through a medium that are scattered: light in thin media is often brighter than
// what lies behind.
constexpr float kLeastScattered = 0.25f;
// Share of these whose distance is sampled near a light.
constexpr float kNearLight = 0.5f;

// Where paths are scattered.
struct MediumEvent {
    Mask scatters;
    Float way;
    // Of the scattered light, without the scattering coefficient; of the light that passes, in the other
    // lanes
    Vec3 weight;
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
// heuristic (Veach 1997). `all`: the derivative by scattering coefficients is requested, so that events count
// where these are 0, too.
EG_INLINE MediumEvent sample_event(const SceneView& scene, const PathPacket& p, Mask may,
                                   const RayMedia& media, Float distance, const PathIndex& index, bool all) {
    MediumEvent event{may, distance, one3()};
    const auto [choice, place] = sobol_pair(index, vertex_pair(p.vertex, kVertexMedium));
    // Choose a channel in proportion to the light that it would scatter
    const Float* const extinction[3] = {&media.extinction.x, &media.extinction.y, &media.extinction.z};
    const Float* const scattering[3] = {&media.scattering.x, &media.scattering.y, &media.scattering.z};
    const Float* const throughput[3] = {&p.throughput.x, &p.throughput.y, &p.throughput.z};
    const Float brightest = largest_component(p.throughput);
    Float share[3], lost[3], total = splat(0.0f), chance = splat(0.0f);
    for (int c = 0; c < 3; ++c) {
        const Mask counts = *(all ? extinction : scattering)[c] > 0.0f;
        share[c] = select(counts, *throughput[c] + 0.1f * brightest + 1e-30f, splat(0.0f));
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
    event.way = select(event.scatters, way, distance);
    event.weight =
        select(event.scatters, kept_over(media.extinction, way) * (1.0f / max(density * chance, 1e-30f)),
               kept_over(media.extinction, distance) * (1.0f / max(1.0f - chance, 1e-30f)));
    return event;
}

}  // namespace edgegrad::EDGEGRAD_ISA
