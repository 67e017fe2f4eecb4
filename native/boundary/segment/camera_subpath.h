// Camera paths up to their vertex number `target`. They are paths of the picture, sampled by the BSDFs.
#pragma once

#include "boundary/segment/camera_sampled_lobes.h"
#include "boundary/segment/fixed_direction_chain.h"
#include "path/path_tracer.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// A surface that scatters a path, shaded by one closure of its material.
struct ScatteringPoint {
    SurfacePoint x;
    TexturePoint point;
    Shader shader;
    Vec3 normal;           // shading normal, on the viewer's side
    Mask both_sides;       // light from behind contributes
    bool by_face = false;  // the face's plane alone decides what lies behind, as for scattered rays

    // f |cos| for light from w, restricted to the `kinds` of scattering (bits 1 << RayKind). What
    // is `followed` is left out: scan lines find it. Compiled once: copies of all lobes in each caller would
    // only compile slowly.
    EG_NOINLINE Vec3 evaluate(const SceneView& scene, Mask active, Vec3 w, Int kinds,
                              const Followed& followed = splat(0.0f)) const {
        const bool all_kinds = !any(active & ((kinds & kScatteredRays) != kScatteredRays));
        Vec3 value = zero3();
        const auto add = [&](const auto& surface, Mask m) EG_INLINE_LAMBDA {
            value = select(m, evaluate_kinds(surface, all_kinds, kinds, m, w).value, value);
        };
        visit(scene, active, add, followed);
        return value;
    }
    // The density with which `sample` returns w.
    EG_INLINE Float density(const SceneView& scene, Mask active, Vec3 w) const {
        Float pdf = splat(0.0f);
        visit(scene, active, [&](const auto& surface, Mask m) EG_INLINE_LAMBDA {
            pdf = select(m, surface.evaluate(m, w).pdf, pdf);
        });
        return pdf;
    }
    EG_INLINE BsdfSample sample(const SceneView& scene, Mask active, Float lobe, Float u, Float v) const {
        BsdfSample s{};
        s.wi = normal;
        visit(scene, active, [&](const auto& surface, Mask m) EG_INLINE_LAMBDA {
            s = select(m, surface.sample(m, lobe, u, v), s);
        });
        return s;
    }

 private:
    // Calls visit_surface(surface, mask) for Lambertian lanes and for all others.
    template <typename Visit>
    EG_INLINE void visit(const SceneView& scene, Mask active, const Visit& visit_surface,
                         const Followed& followed = splat(0.0f)) const {
        const Mask lambertian = active & has(shader, kLambertian), others = active & ~lambertian;
        if (any(lambertian)) {
            const Vec3* smooth = scene.all_flags & kHasNormalMap ? &point.normal : nullptr;
            visit_surface(Lambertian{normal, x.normal, shader.color(kBaseColor), smooth}, lambertian);
        }
        if (!any(others)) return;
        ShadedSurface surface = shaded_surface(scene, others, x, point, shader, normal);
        if (by_face) surface.from_below = false;
        if (any(others & (followed.widest > 0.0f))) follow_lobes(surface.bsdf, others, followed);
        visit_surface(surface, others);
    }
};

// Surfaces that scatter light from behind.
EG_INLINE Mask scatters_on_both_sides(const Shader& shader) {
    return ~has(shader, kLambertian) & transmits(shader);
}

// The surfaces that paths have hit, shaded as in the path tracer.
EG_OUTLINE ScatteringPoint scattering_point(const SceneView& scene, const ImageTask& task,
                                            const PathPacket& p, Mask active, const Closest& hit) {
    ScatteringPoint s;
    s.x = hit_surface(scene, active, hit, p.direction);
    const Float choice = sobol_pair(path_index(task, p.path), vertex_pair(p.vertex, kVertexChoice)).u;
    s.point = texture_point(scene, s.x, -p.direction, p.kind, boundary_history(scene, p.bounces));
    s.shader = surface_shader(scene, s.x, s.point, choice);
    s.normal = shading_normal(scene, s.x.active, s.shader, s.point);
    s.both_sides = scatters_on_both_sides(s.shader);
    return s;
}

// Parts of the throughput of paths.
struct WalkParts {
    Vec3 followed;  // of perfect and followed lobes alone
    Vec3 rough;     // without perfect lobes, and without followed ones at the first surface

    EG_INLINE void multiply(Mask m, Vec3 by_followed, Vec3 by_rough) {
        followed = select(m, followed * by_followed, followed);
        rough = select(m, rough * by_rough, rough);
    }
};

// Continues paths from their first hits to the surfaces at which their segments number `target` end. Paths
// that end earlier, or cannot scatter there, become inactive. Transparent surfaces are passed at random. With
// `camera_sampled` lobes, paths leave the first surface only by camera-sampled lobes
// (camera_sampled_kinds), or they are scattered by a perfect lobe somewhere, and by another one elsewhere.
// Fills `fixed`, if not null, with the surfaces of the path for fixed directions near contact. Sets `parts`,
// if not null, to parts of the throughput.
EG_OUTLINE void walk_camera_paths(const SceneView& scene, const ImageTask& task, PathPacket& p, Closest& hit,
                                  Int target, const CameraSampledLobes& camera_sampled = {},
                                  FixedDirectionChain* fixed = nullptr, WalkParts* parts = nullptr) {
    if (parts) *parts = {p.throughput, p.throughput};
    const bool follows = parts && scene.followed_alpha > 0.0f;
    const bool clear = scene.all_flags & kHasTransparency;
    const bool sharp_alone = camera_sampled.widest > 0.0f, bends = sharp_alone && scene.any_perfect;
    bool begun = false;
    Mask walking = p.active & hit.hit, arrived = splat(0), bent = splat(0), led = splat(-1);
    Vec3 sharp = p.throughput;  // by camera-sampled lobes of the first surface
    while (true) {
        const Mask there = walking & (p.segment == target);
        if (!clear) {
            arrived |= there;
            walking &= ~there;
        }
        if (!any(walking)) break;
        const ScatteringPoint s = scattering_point(scene, task, p, walking, hit);
        // Pass transparent surfaces at random
        const PathIndex index = path_index(task, p.path);
        walking &= s.x.active;
        if (attenuates(scene)) {
            const Mask from_camera = begun ? splat(0) : walking & (p.kind == splat(kCameraRay));
            const Vec3 kept =
                kept_on_segment(scene, s.x, s.shader.closure, p.origin, length_of(s.x.position - p.origin),
                                near_plane(scene, from_camera, p.direction));
            p.throughput = select(walking, p.throughput * kept, p.throughput);
            sharp = select(walking, sharp * kept, sharp);
            if (parts) parts->multiply(walking, kept, kept);
        }
        begun = true;
        Mask pass = splat(0);
        if (clear) {
            const Float chance = sobol_pair(index, vertex_pair(p.vertex, kVertexSurvival)).v;
            Vec3 color;
            pass = walking & has(s.shader, kHasTransparency) & (chance < passing_share(s.shader, color));
            arrived |= there & walking & ~pass;
            walking &= ~arrived;
            const Int kind = splat(kShadowRay);  // kShadowRay counts transparent surfaces
            walking &= ~pass | (bounce_count(p.bounces, kind) < task.limits.transparent);
            p.bounces = add_bounce(p.bounces, walking & pass, kind);
            p.throughput = select(walking & pass, p.throughput * color * s.shader.scale, p.throughput);
            sharp = select(walking & pass, sharp * color * s.shader.scale, sharp);
            if (follows) parts->multiply(walking & pass, color * s.shader.scale, color * s.shader.scale);
            p.origin = select(walking & pass, leave_surface(s.x, p.direction), p.origin);
        }
        // Sample the BSDF for the next direction
        const Mask scattered = walking & ~pass;
        if (any(scattered)) {
            const Float lobe = sobol_pair(index, vertex_pair(p.vertex, kVertexChoice)).v;
            const auto [u, v] = sobol_pair(index, vertex_pair(p.vertex, kVertexDirection));
            const BsdfSample next = s.sample(scene, scattered, lobe, u, v);
            // The path must be able to scatter once more.
            const Mask goes = scattered & next.active & ~next_is_final(task, p, next.ray_kind);
            walking &= pass | goes;
            Vec3 weight = next.weight;
            Int kinds = splat(kScatteredRays);
            if (sharp_alone) {
                kinds = select(p.segment == 1, camera_sampled_kinds(s.shader, camera_sampled), kinds);
                const Vec3 rough =
                    s.evaluate(scene, goes & ~next.specular, next.wi, kinds) * (1.0f / max(next.pdf, 1e-20f));
                weight = select(next.specular, bends ? weight : zero3(), rough);
                sharp = select(goes, sharp * rough * s.shader.scale, sharp);
                bent |= goes & next.specular;
                led &= ~goes | next.specular;
            }
            if (follows) {
                const Vec3 rest =
                    s.evaluate(scene, goes & ~next.specular, next.wi, kinds, splat(scene.followed_alpha)) *
                    (1.0f / max(next.pdf, 1e-20f));
                const Vec3 part = select(next.specular, weight, weight - rest);
                const Vec3 other = select(next.specular, zero3(), select(p.segment == 1, rest, weight));
                parts->multiply(goes, part * s.shader.scale, other * s.shader.scale);
            }
            p.throughput =
                select(goes, p.throughput * (bends ? next.weight : weight) * s.shader.scale, p.throughput);
            p.origin = select(goes, leave_surface(s.x, next.wi), p.origin);
            p.direction = select(goes, next.wi, p.direction);
            p.bounces = add_bounce(p.bounces, goes, next.ray_kind);
            p.kind = select(goes, next.ray_kind, p.kind);
            p.pdf = select(goes, select(next.specular, splat(0.0f), next.pdf), p.pdf);
            p.segment = p.segment - goes;
        }
        // Trace the paths to their next surfaces
        walking &= largest_component(p.throughput) > 0.0f;
        if (!any(walking)) break;
        p.vertex = p.vertex - walking;
        const Closest met =
            intersect(scene, walking, p.origin, p.direction, splat(0.0f), splat(__builtin_inff()),
                      ignore_nothing(), embree::kIncoherent, ray_mask(p.kind));
        walking &= met.hit;
        if (fixed && scene.mesh_contact && any(walking & (fixed->length > 0))) {
            // Segments through transparent surfaces have no blend, so the last surface before `next` will do.
            const SurfacePoint next = hit_surface(scene, walking, met, p.direction);
            set_chain_surface(scene, walking & (fixed->length > 0), p.segment - 2, s.x, next, *fixed);
        }
        hit = select(walking, met, hit);
    }
    if (bends) {
        p.throughput = select(bent, p.throughput, sharp);
        arrived &= ~(led & bent) & (largest_component(p.throughput) > 0.0f);
    }
    p.active = arrived;
    hit.hit = arrived;
}

}  // namespace edgegrad::EDGEGRAD_ISA
