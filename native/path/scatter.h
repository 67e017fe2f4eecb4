// Scattering at a surface: direct light by emitter and environment samples, and the ray that continues.
#pragma once

#include <type_traits>

#include "path/bounces.h"
#include "path/lights/lobe_light.h"
#include "path/lights/thrown_light.h"
#include "path/recorder.h"
#include "path/shaded_surface.h"
#include "path/stream.h"
#include "path/value_recorder.h"
#include "shading/lambertian.h"
#include "shading/lights/environment_samples.h"
#include "shading/lights/light_radiance.h"
#include "shading/lights/lights.h"
#include "shading/terminator.h"
#include "shading/transmittance.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Russian roulette may end a path after this many segments.
constexpr int kRouletteSegment = 3;
// The same for paths recorded only for derivatives with respect to values of shaders and lights. Each of
// their vertices contributes the light of all segments behind it, so that late roulette trades time for
// variance. Paths with geometric derivatives keep the early roulette, since their sweeps cost more per
// vertex.
constexpr int kLateRouletteSegment = 8;
// Least probability of survival.
constexpr float kLeastSurvival = 0.05f;

// The power heuristic. Densities are clamped because a light's density is infinite at a point in the light's
// plane, for example on an edge of an emissive face.
EG_INLINE Float power_heuristic(Float p, Float q) {
    const Float most = splat(1e18f);  // its square is finite
    p = min(p, most);
    q = min(q, most);
    const Float p2 = p * p;
    return p2 / max(p2 + q * q, 1e-38f);
}

// Leaves out light that would make the path's sum infinite or not a number, as sweeps over recorded paths do
// (adjoint/path_sweeps.cpp).
EG_INLINE void add_radiance(Workspace& work, const PathPacket& p, Mask m, Vec3 value) {
    if (work.task->caustics_alone) m &= p.caustic;
    for (int i = 0; i < W; ++i) {
        if (!m[i]) continue;
        const int32_t path = p.path[i];
        const float r = work.radiance[0][path] + value.x[i], g = work.radiance[1][path] + value.y[i],
                    b = work.radiance[2][path] + value.z[i];
        if ((r - r) + (g - g) + (b - b) != 0.0f) {
            if (work.dropped) work.dropped->add(work.task->pixel_of(path));
            continue;
        }
        work.radiance[0][path] = r, work.radiance[1][path] = g, work.radiance[2][path] = b;
    }
}

// Shadow rays of a vertex towards meshes of the ray mask `mask`, and where it is recorded what they pass.
EG_INLINE PassingRays shadow_rays(const Workspace& work, const Vertex* vertex, RecordedRay ray, Int mask) {
    PassingRays rays{mask};
    if (!vertex) return rays;
    VertexMemory& memory = *work.vertices;
    if (memory.passed.closures) rays.record.surfaces = &memory.passed;
    if (memory.media.wanted) rays.record.media = &memory.media;
    rays.record.vertex = static_cast<int32_t>(vertex - &memory.at<W>(0));
    rays.record.ray = ray;
    return rays;
}

// Samples one light. Recorded paths sample sized lights of the table along sharp lobes, too, and what the
// lobes in `throwing` throw by itself.
template <typename Surface>
EG_INLINE LightSample sample_light_at(const SceneView& scene, const PathPacket& p, const SurfacePoint& x,
                                      const Surface& surface, const PathIndex& index, bool recorded,
                                      const Vec3* shading, Int throwing, ThrownSample& thrown) {
    Float u, v;
    UInt number = index.own;
    if constexpr (std::is_same_v<Surface, ShadedSurface>) {
        const Mask sharp = recorded ? any_sharp(surface.bsdf) : splat(0);
        number = bits(select(sharp, bits(index.sample), bits(number)));
        sobol_pair(index.stream, number, vertex_pair(p.vertex, kVertexLight), u, v);
        v = mirrored(sharp & index.mirrored, v);
        const bool sized = scene.lights.all_sized() > 0;
        if (sized && any(p.active & (throwing != 0)))
            return sample_light_and_thrown(scene, p, x, surface, index, number, u, v, shading, throwing,
                                           thrown);
        if (sized && any(p.active & sharp))
            return sample_light_and_lobes(scene, p, x, surface, index, number, u, v, shading);
    } else {
        sobol_pair(index.stream, number, vertex_pair(p.vertex, kVertexLight), u, v);
    }
    return sample_light(scene, p.active, x, p.both_sides, bounces_before(p), u, v, shading);
}

// The normal of the shadow terminator, which normal maps do not bend.
template <typename Surface>
EG_INLINE Vec3 unbent_normal(const Surface& surface) {
    if constexpr (requires { surface.smooth; })
        if (surface.smooth) return *surface.smooth;
    return surface.normal;
}

// Emitter samples from below the triangle's plane (receiving_normal). BSDF samples cannot find their light,
// but as in Cycles they share its weight, which dims large lights there.
EG_INLINE Mask below_plane(const SurfacePoint& x, Vec3 receiving, Vec3 w) {
    return (dot(x.normal, w) <= 0.0f) & (dot(receiving, w) > 0.0f);
}

// Samples direct illumination from the light sources, of which lobes in `throwing` throw a part. Lanes of
// `alone` trace no BSDF sample that could find the same light, so their weight is 1.
template <typename Surface>
EG_OUTLINE void add_light(const SceneView& scene, Workspace& work, const PathPacket& p, const SurfacePoint& x,
                          const Surface& surface, Int throwing, Mask alone, const PathIndex& index,
                          Vertex* vertex) {
    // Sample a light and evaluate the BSDF
    const Vec3 receiving = receiving_normal(scene, x, unbent_normal(surface));
    const Vec3* shading = scene.any_terminator ? &receiving : nullptr;
    ThrownSample thrown;
    LightSample s =
        sample_light_at(scene, p, x, surface, index, vertex != nullptr, shading, throwing, thrown);
    look_up_emission(scene, s);
    const BsdfValue f =
        scattered_light(scene, surface, s.visible_to, s.active, followed_for(scene, s.active, s.row), s.w);
    // Recorded light omits the radiance and the BSDF: factors that are zero may have derivatives.
    Vec3 light = s.radiance * f.value * s.geometry;
    if (vertex) {
        const Mask scatters = (f.pdf > 0.0f) | (largest_component(f.value) > 0.0f) | thrown.active;
        light = gray(select(scatters, s.geometry, 0.0f));
    }
    if (work.values) {
        light = f.value * s.geometry;
        s.active &= gives(*work.values, s);
    }
    s.active &= largest_component(light) > 0.0f;
    if (!any(s.active)) return;
    // Combine with BSDF samples, except for lights of the table: recorded paths find those by emitter samples
    // alone, in lobes that are not followed
    Mask found = ~alone & (vertex ? s.row < 0 : splat(-1));
    if constexpr (requires { surface.gloss; }) found &= (s.row < 0) | ~surface.by_emitters_alone(s.w);
    if (shading) found |= below_plane(x, receiving, s.w);
    const Mask shared = s.active & found & (s.pdf > 0.0f);
    if (any(shared)) light = light * select(shared, power_heuristic(s.pdf, f.pdf), 1.0f);
    // Trace the shadow rays
    if (!scene.convex) {
        const Vec3 start = leave_surface(x, s.w) + terminator_lift(scene, x, unbent_normal(surface), s.w);
        const Vec3 direction = select(s.distant, s.w, s.end - start);
        const Float far = select(s.distant, splat(__builtin_inff()), 0.99999f);
        const Vec3 through = transmittance(scene, s.active & s.casts_shadow, start, direction, far,
                                           shadow_rays(work, vertex, kRayToLight, s.blockers));
        light = select(s.casts_shadow, light * through, light);
    }
    // Record the sample or add its light
    if (vertex) {
        record_light_contact(scene, *vertex, p, x, s);
        record_thrown(*vertex, s.active & thrown.active, thrown.lobe, thrown.half);
        return record_light(*vertex, s, light);
    }
    if (work.values) return record_received(scene, *work.values, s, light);
    add_radiance(work, p, s.active, p.throughput * light);
}

// Samples direct illumination from the environment's image.
template <typename Surface>
EG_OUTLINE void add_environment_light(const SceneView& scene, Workspace& work, const PathPacket& p,
                                      const SurfacePoint& x, const Surface& surface, const PathIndex& index,
                                      Vertex* vertex) {
    // Sample a direction and evaluate the BSDF
    Float u, v;
    sobol_pair(index.stream, index.own, vertex_pair(p.vertex, kVertexEnvironment), u, v);
    const EnvironmentSample s = sample_environment(scene, p.active, u, v);
    Mask above = p.both_sides | (dot(x.normal, s.w) > 0.0f);
    if (scene.any_terminator) above |= dot(receiving_normal(scene, x, unbent_normal(surface)), s.w) > 0.0f;
    Mask active = p.active & (s.pdf > 0.0f) & above;
    const BsdfValue f = surface.evaluate(active, s.w);
    const Float scale = power_heuristic(s.pdf, f.pdf) / max(s.pdf, 1e-37f);
    Vec3 light = s.radiance * f.value * scale;
    if (vertex) light = gray(select((f.pdf > 0.0f) | (largest_component(f.value) > 0.0f), scale, 0.0f));
    if (work.values) light = environment_gain(scene, s.w) * f.value * scale;
    active &= largest_component(light) > 0.0f;
    if (!any(active)) return;
    // Trace the shadow rays
    if (!scene.convex) {
        const Vec3 start = leave_surface(x, s.w) + terminator_lift(scene, x, unbent_normal(surface), s.w);
        light = light * transmittance(scene, active, start, s.w, splat(__builtin_inff()),
                                      shadow_rays(work, vertex, kRayToEnvironment, splat(1 << kShadowRay)));
    }
    // Record the sample or add its light
    if (vertex) {
        put3(vertex->environment_direction, active, s.w);
        return put3(vertex->environment_scale, active, light);
    }
    if (work.values) return record_environment(scene, *work.values, active, light);
    add_radiance(work, p, active, p.throughput * light);
}

// Adds environment light along the last ray of a path, which needs only a visibility test. Where the
// unoccluded integral is `known`, the occluded part is subtracted from it instead.
EG_INLINE void add_final_environment(const SceneView& scene, Workspace& work, const PathPacket& p,
                                     const SurfacePoint& x, Mask active, const BsdfSample& s, Mask known,
                                     Vertex* vertex) {
    active &= (splat(scene.environment_mask) & ray_mask(s.ray_kind)) != 0;
    if (!any(active)) return;
    Vec3 light = vertex        ? gray(1.0f / max(s.pdf, 1e-30f))
                 : work.values ? s.weight * environment_gain(scene, s.wi)
                               : p.throughput * s.weight * environment_radiance(scene, s.wi);
    if (scene.environment_image.sampled) light = light * power_heuristic(s.pdf, environment_pdf(scene, s.wi));
    Vec3 through = one3();
    if (!scene.convex)
        through = transmittance(scene, active, leave_surface(x, s.wi), s.wi, splat(__builtin_inff()),
                                shadow_rays(work, vertex, kLastRay, ray_mask(s.ray_kind)));
    const Float all = select(known, splat(1.0f), splat(0.0f));
    light = light * Vec3{through.x - all, through.y - all, through.z - all};
    if (vertex) return put3(vertex->last_scale, active, light);
    if (work.values) return record_environment(scene, *work.values, active, light);
    add_radiance(work, p, active, light);
}

// Continues paths from x by a bounce of `kind` in direction w, sampled with the solid-angle density `pdf`.
EG_INLINE void leave(PathPacket& p, const SurfacePoint& x, Vec3 receiving, Vec3 w, Int kind, Float pdf) {
    p.origin = leave_surface(x, w);
    p.direction = w;
    p.from = x.position;
    p.from_normal = x.normal;
    p.from_receiving = receiving;
    p.from_mesh = x.mesh;
    p.pdf = pdf;
    p.bounces = add_bounce(p.bounces, p.active, kind);
    p.kind = kind;
    p.segment = p.segment + 1;
    p.vertex = p.vertex + 1;
}

// Scatters a packet's paths at x and appends the rays that continue to the queue. Returns the queue's new
// length.
template <typename Surface>
EG_OUTLINE int scatter(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket p,
                       const SurfacePoint& x, const Surface& surface, const PathIndex& index, Float lobe_u,
                       int alive, Vertex* vertex) {
    // The last ray from a Lambertian surface finds only the environment.
    Mask alone = splat(0);
    if constexpr (Surface::kSmooth) alone = next_is_final(task, p, splat(kDiffuseRay));
    p.both_sides = surface.both_sides();
    const Mask scattered = p.active;
    const ValueMemory* values = work.values;
    const bool recorded = vertex || values;
    Int throwing = splat(0);
    if constexpr (std::is_same_v<Surface, ShadedSurface>)
        if (const Mask aside = p.active & p.rough & ~p.led;
            vertex && scene.thrown_alpha > 0.0f && any(aside)) {
            throwing = throwing_lobes(surface.bsdf, aside, splat(scene.thrown_alpha));
            put(vertex->throws, aside, throwing);
        }
    // Sample direct illumination from the light sources and the environment
    if (recorded) p.active &= p.touched;
    const bool rims = vertex && work.vertices->rims;
    if (rims) p.active &= p.past_rim;
    if (any(p.active)) {
        if (scene.lights.count > 0 && (!values || requests_lights(*values)))
            add_light(scene, work, p, x, surface, throwing, alone, index, vertex);
        if (scene.environment_image.sampled && (!values || requests_environment(*values)))
            add_environment_light(scene, work, p, x, surface, index, vertex);
    }
    p.active = scattered;
    if (!scene.has_environment || (values && !requests_environment(*values))) p.active &= ~alone;
    if (!any(p.active)) return alive;

    // Sample the BSDF
    Float u, v;
    const UInt number = bits(select(alone, bits(index.own), bits(index.sample)));
    sobol_pair(index.stream, number, vertex_pair(p.vertex, kVertexDirection), u, v);
    if constexpr (std::is_same_v<Surface, ShadedSurface>)
        if (any(index.mirrored))
            v = mirrored(index.mirrored & any_sharp(surface.bsdf) & ~has_followed_lobes(surface.bsdf), v);
    BsdfSample s = surface.sample(p.active, lobe_u, u, v);
    if (vertex) record_direction(*vertex, p.active, s, std::is_same_v<Surface, Lambertian>);
    if constexpr (std::is_same_v<Surface, ShadedSurface>)
        if (any(throwing != 0)) record_thrown_ray(*vertex, p.active, surface.bsdf, throwing, s);
    p.active &= s.active;
    // Add environment light along last rays from Lambertian surfaces
    const Mask last = p.active & alone & (recorded ? p.touched : splat(-1));
    Mask known = splat(0);
    if constexpr (requires { surface.environment_is_known; }) known = surface.environment_is_known;
    if (any(last)) add_final_environment(scene, work, p, x, last, s, known, vertex);
    p.active &= ~alone;
    if (!any(p.active)) return alive;

    p.final_ray = next_is_final(task, p, s.ray_kind);
    // End paths that cannot contribute. The last surface of a path does not scatter. Its emission contributes
    // only if the path has met a requested surface.
    if (recorded && !(scene.all_flags & kHasTransparency)) p.active &= p.touched | ~p.final_ray;
    if (values && !requests_met_light(scene, *values)) p.active &= ~p.final_ray;
    if (rims) p.active &= p.past_rim | ~p.final_ray;
    // Update the throughput and apply Russian roulette
    p.throughput = p.throughput * s.weight;
    if (values) p.throughput = p.throughput * scattering_color(*values);
    const Float brightest = largest_component(p.throughput);
    if (!recorded) p.active &= brightest > 0.0f;
    const bool late = values ? values->colors : (vertex && !work.vertices->geometry);
    const int first_risk = late ? kLateRouletteSegment : kRouletteSegment;
    const Mask risky = p.active & (p.segment >= first_risk) & (brightest < 1.0f);
    if (any(risky)) {
        const Float roulette = sobol_pair(index, vertex_pair(p.vertex, kVertexSurvival)).u;
        const Float survival = select(risky, max(brightest, kLeastSurvival), splat(1.0f));
        p.active &= roulette < survival;
        p.throughput = p.throughput * (1.0f / survival);
        if (vertex) record_survival(*vertex, p.active, survival);
        if (values) record_next(*work.values, p.active, s.weight * (1.0f / survival));
    } else {
        if (vertex) record_survival(*vertex, p.active, splat(1.0f));
        if (values) record_next(*work.values, p.active, s.weight);
    }
    // Continue the surviving paths
    p.caustic |= ~p.led & s.specular;
    p.led &= s.specular;
    p.rough &= ~s.specular;
    p.lobe = {};
    if constexpr (requires { surface.bsdf; })
        if (vertex && scene.light_followed)
            p.lobe = lobe_of_rays(surface.bsdf, s.lobe, s.transmitted, s.half);
    p.unlit = splat(0);
    if constexpr (requires { surface.gloss; })
        if (!vertex) p.unlit = ~s.specular & surface.by_emitters_alone(s.wi);
    leave(p, x, receiving_normal(scene, x, unbent_normal(surface)), s.wi, s.ray_kind,
          select(s.specular, splat(0.0f), s.pdf));
    return append_paths(work.paths, alive, p);
}

}  // namespace edgegrad::EDGEGRAD_ISA
