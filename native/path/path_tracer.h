// The path tracer. It estimates the radiance along camera rays, for paths of up to `max_depth` segments,
//   L(x, wo) = L_e(x, wo) + int f(wo, w) |n.w| L(x', -w) dw.
// Each vertex takes one emitter sample and one BSDF sample, combined by the power heuristic (Veach 1997).
// Russian roulette ends long paths. A task's paths advance one segment at a time: all rays of the queue are
// traced in packets, then all hits are shaded, then the surviving paths are compacted.
//
// Light that one strategy samples well is not sampled by a second one. BSDF samples alone find a constant
// environment. Emitter samples alone find lights from a Lambertian vertex at the end of a path, so its last
// segment is traced only to find the environment.
#pragma once

#include "path/edge_step.h"
#include "path/first_rays.h"
#include "path/media/crossing.h"
#include "path/recorder.h"
#include "path/rim.h"
#include "path/scatter.h"
#include "path/shaded_surface.h"
#include "path/value_recorder.h"
#include "shading/absorption.h"
#include "shading/bsdf/favoured_lobes.h"
#include "shading/emission.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE void store_hits(HitQueue& hits, int at, const Closest& hit) {
    store(hits.face + at, select(hit.hit, hit.face, splat(-1)));
    store(hits.mesh + at, hit.mesh);
    store(hits.instance + at, hit.instance);
    store(hits.b1 + at, hit.b1);
    store(hits.b2 + at, hit.b2);
    store(hits.distance + at, hit.distance);
}

EG_INLINE Closest load_hits(const HitQueue& hits, int at, Mask hit) {
    Closest closest;
    closest.hit = hit;
    closest.face = load(hits.face + at), closest.mesh = load(hits.mesh + at);
    closest.instance = load(hits.instance + at);
    closest.b1 = load(hits.b1 + at), closest.b2 = load(hits.b2 + at);
    closest.distance = load(hits.distance + at);
    return closest;
}

// Starts the task's camera paths and traces their first rays. Returns the number of paths.
EG_INLINE int start_paths(const SceneView& scene, const ImageTask& task, Workspace& work) {
    const CameraView& camera = scene.camera;
    const int count = task.pixel_count * task.samples;
    PathPacket p = first_segment(task.max_depth);
    const RequestedSurfaces* requested = requested_surfaces(work);
    p.touched = splat(requested && requested->everywhere ? -1 : 0);
    for (int at = 0; at < count; at += W) {
        p.active = first_lanes(count - at);
        p.path = lane_index() + at;
        // Sample the point on the film and the point on the lens
        const PathIndex index = path_index(task, p.path);
        const auto [u, v] = sobol_pair(index, kPairPixel);
        const auto [lens_u, lens_v] = lens_numbers(camera, index);
        const Int rows = quotient(index.pixel + task.column, camera.width);
        const Float sx = to_float(index.pixel + task.column - rows * camera.width) + filter_sample(camera, u);
        const Float sy = to_float(rows + task.row) + filter_sample(camera, v);
        if (work.vertices) {
            store(work.camera.x + at, sx), store(work.camera.y + at, sy);
            store(work.camera.lens_u + at, lens_u), store(work.camera.lens_v + at, lens_v);
        }
        // Trace the camera rays and queue the paths with their hits
        store_hits(work.hits, at, trace_first(scene, p, sx, sy, lens_u, lens_v, embree::kCoherent));
        append_paths(work.paths, at, p);
        for (int c = 0; c < 3; ++c) store(work.radiance[c] + at, splat(0.0f));
    }
    return count;
}

EG_INLINE void trace_paths(const SceneView& scene, Workspace& work, int count) {
    for (int at = 0; at < count; at += W) {
        const PathPacket p = load_paths(work.paths, at, count);
        const Closest hit =
            intersect(scene, p.active, p.origin, p.direction, splat(0.0f), splat(__builtin_inff()),
                      ignore_nothing(), embree::kIncoherent, ray_mask(p.kind));
        store_hits(work.hits, at, hit);
    }
}

// Adds environment light along rays that miss the scene. The MIS weight accounts for samples of the
// environment's image.
EG_INLINE void add_environment(const SceneView& scene, Workspace& work, const PathPacket& p, Mask missed,
                               Vertex* vertex) {
    missed &= (splat(scene.environment_mask) & ray_mask(p.kind)) != 0;
    if (!any(missed) || (work.values && !requests_environment(*work.values))) return;
    Float weight = splat(1.0f);
    if (scene.environment_image.sampled)
        weight = select(p.pdf > 0.0f, power_heuristic(p.pdf, environment_pdf(scene, p.direction)), weight);
    if (vertex) return put(vertex->environment_weight, missed, weight);
    if (work.values)
        return record_own(*work.values, missed, splat(kEnvironmentSource), splat3(scene.environment),
                          environment_gain(scene, p.direction) * weight);
    add_radiance(work, p, missed, p.throughput * environment_radiance(scene, p.direction) * weight);
}

// The last scattering event as the receiver of emitter samples.
EG_INLINE Receiver last_receiver(const SceneView& scene, const PathPacket& p) {
    return {p.from, p.from_normal, p.both_sides, scene.any_terminator ? &p.from_receiving : nullptr,
            select(p.kind == splat(kMediumRay), splat(1.0f), 0.0f)};
}

// Adds emission of the surface that a ray has hit. The MIS weight accounts for emitter samples.
EG_INLINE void add_emission(const SceneView& scene, Workspace& work, const PathPacket& p,
                            const SurfacePoint& x, const Shader& shader, const TexturePoint& point,
                            Vertex* vertex) {
    const Mask emits = x.active & has(shader, kHasEmission);
    if (!any(emits) || (work.values && !requests_emission(*work.values))) return;
    Float weight = splat(1.0f);
    const Mask sampled = emits & (p.pdf > 0.0f);
    if (any(sampled)) {
        // The segment starts at the last scattering event; transparent surfaces may lie between.
        const Vec3 way = x.position - p.from;
        const Float pdf =
            light_pdf(scene, sampled, last_receiver(scene, p), x.face, p.direction, sqrt(dot(way, way)));
        weight = select(sampled, power_heuristic(p.pdf, pdf), splat(1.0f));
    }
    if (vertex) return put(vertex->emission_weight, emits, weight);
    if (work.values) {
        Shader bright = shader;
        for (int c = 0; c < 3; ++c) bright.row[kEmission + c] = splat(1.0f);
        return record_own(*work.values, emits, light_source(kLeafSource, shader.closure),
                          shader.color(kEmission), closure_emission(x, bright, point) * weight);
    }
    add_radiance(work, p, emits, p.throughput * closure_emission(x, shader, point) * weight);
}

// Adds lights of the light table that a ray meets. Such lights do not block rays. `media` around the ray,
// null: none.
EG_INLINE void add_sized_lights(const SceneView& scene, Workspace& work, const PathPacket& p, Float distance,
                                const RayMedia* media) {
    if (work.values && !requests_rows(*work.values)) return;
    const Mask meets = p.active & ~p.unlit;
    const Float near = way_so_far(p);
    const Receiver from = last_receiver(scene, p);
    const Float begin = media ? near + media->begin : near;
    if (work.values)
        return for_each_light_along(
            scene, meets & p.touched, from, p.from_mesh, p.direction, near, near + distance, p.pdf, p.kind,
            bounces_before_last(p), p.lobe, [&](int row, Mask seen, Vec3 radiance, Float gain, Float at) {
                Vec3 gains = gray(gain);
                if (media) gains = gains * kept_over(media->extinction, max(at - begin, 0.0f));
                record_met_light(*work.values, p, seen, row, radiance, gains);
            });
    const Vec3 light =
        lights_along(scene, meets, from, p.from_mesh, p.direction, near, near + distance, p.pdf, p.kind,
                     bounces_before_last(p), p.lobe, media ? &media->extinction : nullptr, begin);
    const Mask found = p.active & (largest_component(light) > 0.0f);
    if (any(found)) add_radiance(work, p, found, p.throughput * light);
}

// Sends part of the paths through a transparent surface and removes them from the active lanes of `x`.
// Multiplies the shader's scale by the weight of the paths that remain.
EG_INLINE int pass_through(const ImageTask& task, Workspace& work, PathPacket p, SurfacePoint& x,
                           Shader& shader, const PathIndex& index, int alive, Vertex* vertex) {
    const Mask may = x.active & has(shader, kHasTransparency);
    if (!any(may)) return alive;
    const Float u = sobol_pair(index, vertex_pair(p.vertex, kVertexSurvival)).v;
    Vec3 color;
    const Float share = passing_share(shader, color);
    // Keep both choices possible where only one has a nonzero probability but both have derivatives
    Mask ends = splat(0);
    Float chance = share;
    if (vertex) {
        ends = may & ((share <= 0.0f) | (share >= 1.0f)) &
               share_ends_change(work.vertices->passed, shader.closure);
        chance = select(ends, chance_at_ends(share), share);
    }
    // Choose the paths that pass through the surface
    p.active = may & (u < chance);
    x.active &= ~p.active;
    if (vertex) put(vertex->passes, p.active, splat(-1));
    if (work.values) record_passing(*work.values, p.active, color);
    // Continue the transmitted paths behind the surface
    const Int kind = splat(kShadowRay);  // the fourth count: transparent surfaces
    p.active &= bounce_count(p.bounces, kind) < task.limits.transparent;
    p.bounces = add_bounce(p.bounces, p.active, kind);
    p.throughput = p.throughput * color * shader.scale;
    if (any(ends)) {
        p.throughput = p.throughput * select(ends, share / chance, splat(1.0f));
        shader.scale = shader.scale * select(ends, (1.0f - share) / (1.0f - chance), splat(1.0f));
    }
    p.origin = leave_surface(x, p.direction);
    p.vertex = p.vertex + 1;
    return append_paths(work.paths, alive, p);
}

// Scatters the paths of a packet. Lambertian surfaces take a shorter code path, since they need only an
// albedo.
EG_INLINE int scatter_at(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket p,
                         const SurfacePoint& x, const TexturePoint& point, const Shader& shader,
                         const PathIndex& index, Float lobe_u, int alive, Vertex* vertex) {
    const Vec3 normal = shading_normal(scene, x.active, shader, point);
    // Scatter at Lambertian surfaces
    const Mask lambertian = p.active & has(shader, kLambertian);
    if (any(lambertian)) {
        Vec3 albedo = shader.color(kBaseColor);
        PathPacket part = p;
        part.active = lambertian;
        if (work.values) {
            record_color(*work.values, lambertian, shader.closure, albedo);
            albedo = one3();
        }
        if (!vertex) part.active &= largest_component(albedo) > 0.0f;
        const Vec3* smooth = scene.all_flags & kHasNormalMap ? &point.normal : nullptr;
        const Lambertian surface{normal, x.normal, albedo, smooth, vertex && work.vertices->geometry};
        if (any(part.active))
            alive = scatter(scene, task, work, part, x, surface, index, lobe_u, alive, vertex);
    }
    PathPacket part = p;
    part.active = p.active & ~lambertian;
    if (any(part.active)) {
        // Evaluate the closures of all other surfaces
        ShadedSurface surface = shaded_surface(scene, part.active, x, point, shader, normal);
        surface.bsdf.glass.by_slope = vertex && work.vertices->geometry;
        // Record which lobes are followed
        if (vertex && scene.followed_alpha > 0.0f)
            put(vertex->follows, part.active,
                follow_lobes(surface.bsdf, part.active & part.led, splat(scene.followed_alpha)));
        // Scatter some paths along the rims of their transmission lobes
        if (vertex && work.vertices->rims) {
            const RimChoice rim = choose_rims(scene, task, part, surface, index);
            if (any(rim.taken)) {
                alive = scatter_at_rim(scene, task, work, part, x, surface, rim, alive, *vertex);
                part.active &= ~rim.taken;
                if (!any(part.active)) return alive;
            }
            part.throughput = part.throughput * rim.others;
        }
        // Favour lobes whose roughness is requested
        if (vertex && work.vertices->requested.lobes) {
            const RequestedSurfaces& requested = work.vertices->requested;
            favour(surface.bsdf, part.active & is_requested(requested, shader.closure), requested.lobes,
                   next_is_final(task, p, splat(kGlossyRay)));
        }
        alive = scatter(scene, task, work, part, x, surface, index, lobe_u, alive, vertex);
    }
    return alive;
}

// Returns whether rays that miss the scene contribute to a derivative: by the environment's own light, or by
// its product with the derivative of an earlier vertex. Skipping the others avoids sweeps over empty packets.
EG_INLINE bool misses_count(const SceneView& scene, const VertexMemory& vertices, const PathPacket& p) {
    return vertices.misses || (scene.has_environment && any(p.active & (p.vertex > 0)));
}

// Advances the queue's `count` paths by one segment: shades their hits. Returns the number of paths that
// continue.
EG_INLINE int shade_paths(const SceneView& scene, const ImageTask& task, Workspace& work, int count) {
    const RequestedSurfaces* requested = requested_surfaces(work);
    const bool moving = requested && requested->moving;
    int alive = 0;
    for (int at = 0; at < count; at += W) {
        // Load the paths and drop those that cannot reach a requested surface
        PathPacket p = load_paths(work.paths, at, count);
        const Int face = load(work.hits.face + at);
        Mask hit = p.active & (face >= 0);
        if (moving) {
            p.touched |= hit & (gather(scene.face_moving, select(hit, face, splat(0))) != 0);
            if (!any(p.active & may_touch(*requested, task, p, hit)) && !scene.any_medium) continue;
        }
        // Add lights that rays meet before their surfaces. For recorded paths, sweeps do so behind perfect
        // and followed lobes (adjoint/vertex.h); other light of the table is found by emitter samples alone.
        const Float distance = select(hit, load(work.hits.distance + at), splat(__builtin_inff()));
        RayMedia media;
        const bool in_media =
            scene.any_medium && find_media(scene, work, p, distance, work.hits.edges != nullptr, media);
        if (!work.vertices && scene.lights.all_sized() > 0)
            add_sized_lights(scene, work, p, distance, in_media ? &media : nullptr);
        // Scatter paths in media. What media scatter towards the start of a boundary sample is no part of its
        // edge's light.
        if (in_media && work.hits.edges) {
            p.throughput = p.throughput * kept_over(media.extinction, distance - media.begin);
        } else if (in_media) {
            alive = cross_medium(scene, task, work, p, load_hits(work.hits, at, hit), media, moving, alive);
            hit &= p.active;
            if (!any(p.active)) continue;
        }
        // Record the vertices of paths whose derivatives are computed
        Vertex* vertex = nullptr;
        if (work.vertices && !any(hit) && !misses_count(scene, *work.vertices, p)) continue;
        if (work.vertices) {
            vertex = &work.vertices->append<W>();
            record_arrival(scene, *vertex, p, hit, load_hits(work.hits, at, hit));
            // The vertex in the medium has the lights on the way through it
            if (in_media) put(vertex->near, media.dense(), load(vertex->far));
        }
        if (work.values) record_values(*work.values, p, p.active);
        // Add environment light along rays that miss the scene
        if (scene.has_environment) add_environment(scene, work, p, p.active & ~hit, vertex);
        if (!any(hit)) {
            if (vertex) keep_touched(*work.vertices, *vertex, p.touched);
            if (work.values) keep_touched(*work.values, work.values->latest<W>(), p.touched);
            continue;
        }
        // Compute the surface points
        SurfacePoint x = surface_point(scene, hit, face, load(work.hits.b1 + at), load(work.hits.b2 + at),
                                       p.direction, select(hit, load(work.hits.instance + at), splat(-1)));
        x.mesh = select(hit, load(work.hits.mesh + at), splat(0));
        // Move paths that start at an edge of a boundary sample beside that edge
        Mask bends = splat(0);
        if (work.hits.edges) {
            Vec3 step;
            load3(step, work.hits.edges->aside, at);
            x.position = select(hit, x.position + step, x.position);
            bends = hit & (load(work.hits.edges->other + at) >= 0);
        }
        // Evaluate textures and choose a closure
        const PathIndex index = path_index(task, p.path);
        Float choice_u = splat(0.5f), choice_v = choice_u;
        if (vertex || any(bends) || scene.any_mixture || (scene.all_flags & (kHasGlossy | kHasTransparency)))
            sobol_pair(index.stream, index.sample, vertex_pair(p.vertex, kVertexChoice), choice_u, choice_v);
        const RayHistory history = ray_history(scene, p.bounces, x.position - p.from);
        const TexturePoint point = texture_point(scene, x, -p.direction, p.kind, history);
        Shader shader = surface_shader(scene, x, point, choice_u);
        if (scene.all_flags & kHasAbsorption)
            p.throughput =
                p.throughput * kept_inside(scene, x, shader.closure, length_of(x.position - p.origin));
        // Record the surfaces, and drop vertices without a requested surface
        if (requested) p.touched |= hit & is_requested(*requested, shader.closure);
        if (vertex) {
            put(vertex->closure, hit, shader.closure);
            put(vertex->scale, hit, shader.scale);
            store(vertex->touched, p.touched);
            record_contact(scene, *vertex, p, x);
            keep_touched(*work.vertices, *vertex, moving ? may_touch(*requested, task, p, hit) : p.touched);
        }
        if (work.values)
            record_surface(*work.values, hit, load_hits(work.hits, at, hit), shader.scale, p.touched);
        // Send part of the paths through transparent surfaces
        if (scene.all_flags & kHasTransparency)
            alive = pass_through(task, work, p, x, shader, index, alive, vertex);
        if (!any(x.active)) continue;
        // Add emission of the surfaces
        if (scene.all_flags & kHasEmission) add_emission(scene, work, p, x, shader, point, vertex);

        // Scatter the paths at their surfaces
        p.active = x.active & ~p.final_ray;
        p.throughput = p.throughput * shader.scale;
        if (!any(p.active)) continue;
        if (any(bends)) {
            const EdgeStarts& starts = *work.hits.edges;
            PathPacket part = p;
            part.active &= bends;
            alive = scatter_step(scene, task, work, part, x, point, shader,
                                 select(part.active, load(starts.other + at), splat(0)), load(starts.b1 + at),
                                 load(starts.b2 + at), index, choice_v, alive);
            p.active &= ~bends;
            if (!any(p.active)) continue;
        }
        alive = scatter_at(scene, task, work, p, x, point, shader, index, choice_v, alive, vertex);
    }
    return alive;
}

}  // namespace edgegrad::EDGEGRAD_ISA
