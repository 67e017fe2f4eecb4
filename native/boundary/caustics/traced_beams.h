// Light beams: where light passes that perfect lobes throw on other surfaces. The beams of a pilot tell
// samples of edges in which directions small lights are found by way of mirrors and smooth glass
// (boundary/samples/aimed_direction.h).
//
// A point m_K of a mirror is sampled by area, and light for it as in pictures. The light is followed to x
// (boundary/caustics/bent_light.h). What lies between the light and m_K is ignored: its edges are looked for.
#pragma once

#include "boundary/caustics/caustic_path.h"
#include "boundary/segment/camera_connection.h"
#include "shading/lights/environment_samples.h"
#include "shading/lights/lights.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The point of a sample on a face in place of an edge, for numbers of its cell.
EG_INLINE Closest mirror_point(const SceneView& scene, const SegmentSample& p, Float u, Float v,
                               Triangle& triangle) {
    const Float root = sqrt(u);
    Closest m;
    m.hit = p.active;
    m.face = p.edge, m.instance = p.instance;
    m.mesh = mesh_of(scene, p.edge);
    m.b1 = 1.0f - root, m.b2 = v * root;
    m.distance = splat(0.0f);
    triangle = placed_triangle(scene, m.face, m.instance).triangle;
    return m;
}

// Light that arrives at m: its direction, its distance, and its radiance over the density of directions.
struct ArrivingLight {
    Vec3 w;
    Float distance, flux;
    Mask may_be_thrown;
};

// Lights that no ray can meet have none.
EG_OUTLINE ArrivingLight choose_arriving(const SceneView& scene, const SegmentSample& p, Vec3 m,
                                         Vec3 normal) {
    const auto [u, v] = sobol_pair(p.random, kPairLight);
    const Float pick = sobol_pair(p.random, kPairStrategy).u;
    const bool lights = scene.lights.count > 0, image = scene.environment_image.sampled;
    const float by_image = !image ? 0.0f : lights ? 0.5f : 1.0f;
    const auto mean = [](Vec3 a)
                          EG_INLINE_LAMBDA { return (abs(a.x) + abs(a.y) + abs(a.z)) * (1.0f / 3.0f); };
    const Mask throws = splat(scene.thrown_alpha > 0.0f ? -1 : 0);
    ArrivingLight out{normal, splat(__builtin_inff()), splat(0.0f), splat(0)};
    const Mask of_image = p.active & (pick < by_image), of_lights = p.active & ~of_image;
    if (image && any(of_image) && (scene.environment_mask & kBentRays)) {
        const EnvironmentSample e = sample_environment(scene, of_image, u, v);
        const Mask found = of_image & (e.pdf > 0.0f);
        out.may_be_thrown = found & throws;
        out.w = select(found, e.w, out.w);
        out.flux = select(found, mean(e.radiance) / max(e.pdf * by_image, 1e-30f), out.flux);
    }
    if (lights && any(of_lights)) {
        const SurfaceReceiver at{{m, normal, splat(-1), nullptr}, p.edge};
        const LightSample s = sample_light_for(scene, of_lights, at, u, v);
        const Mask found = of_lights & s.active & (s.pdf > 0.0f) & ((s.visible_to & kBentRays) != 0);
        out.w = select(found, s.w, out.w);
        out.distance = select(found & ~s.distant, s.r, out.distance);
        out.may_be_thrown = found & (s.row >= 0) & throws;
        out.flux = select(found, mean(s.radiance) * s.geometry * (1.0f / (1.0f - by_image)), out.flux);
    }
    return out;
}

// Writes the beam of each sample.
EG_OUTLINE void find_light_beams(const SceneView& scene, const BoundaryTask& task, BeamPaths& out) {
    // Light at places that the camera sees by further surfaces at most.
    constexpr float kOutOfView = 0.05f, kFarOff = 1e3f;
    SegmentCursor cursor = first_segment(task);
    for (int64_t at = 0; at < task.count; at += W) {
        const SegmentSample p = sample_entry(task, at, cursor);
        Float u, v;
        cell_numbers(task, p, u, v);
        Triangle t;
        const Closest m = mirror_point(scene, p, u, v, t);
        const Vec3 last = interpolate(t, m.b1, m.b2), area = area_normal(t);
        const Float size = max(sqrt(dot(area, area)), 1e-30f);
        const ArrivingLight arrives = choose_arriving(scene, p, last, area * (1.0f / size));
        Mask active = p.active & (arrives.flux > 0.0f);
        Float weight = splat(0.0f);
        Vec3 light = last, first = last, end = last;
        if (any(active)) {
            const BentLight bent = follow_bent_light(scene, p.random, active, m, arrives.w,
                                                     most_of_caustic(task), arrives.may_be_thrown);
            active &= bent.x.hit;
            end = hit_surface(scene, active, bent.x, bent.along).position;
            first = end - bent.along * bent.x.distance;
            const Vec3 way = first - last;
            const Float far = kFarOff * (bent.x.distance + sqrt(dot(way, way)));
            light = last + arrives.w * select(arrives.distance < __builtin_inff(), arrives.distance, far);
            const Float seen =
                select(place_in_picture(scene, active, end, p.random).active, splat(1.0f), kOutOfView);
            const Float through =
                (abs(bent.weight.x) + abs(bent.weight.y) + abs(bent.weight.z)) * (1.0f / 3.0f);
            weight = select(active, arrives.flux * abs(dot(area, arrives.w)) * through * seen / p.density,
                            splat(0.0f));
        }
        store3(out.light, at, light), store3(out.last, at, last);
        store3(out.first, at, first), store3(out.end, at, end);
        store(out.weight + at, weight), store(out.distance + at, arrives.distance);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
