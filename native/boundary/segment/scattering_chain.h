// Chains of surfaces through which the camera sees a point x that is not a first hit. The light that x
// scatters is followed from surface to surface, x = x_k, x_(k-1), ..., x_1, and x_1 is connected to the
// camera.
//
// The importance of light that arrives at x along w is (derivations, section 2)
//   W(x) = int do f |n_s . w|/|n . w| |n . o| W(x'),
// where o is the direction in which x scatters and x' the surface along o. Light that is traced from its
// source meets surfaces with the geometric cosine, but camera paths with the cosine to the shading normal.
// The factor |n_s . w|/|n . w| corrects for that (Veach 1997, section 5.3.2). o is sampled as if the surface
// scattered a camera path that arrives along -w. The BSDF is evaluated as a camera path that arrives along -o
// sees it.
#pragma once

#include "boundary/segment/camera_connection.h"
#include "boundary/segment/chain_bounce.h"
#include "boundary/segment/receiver.h"
#include "boundary/segment/segment.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"
#include "tasks/scan_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The current end of a chain: the point where light of `weight` arrives along w.
struct Chain {
    Closest at;  // hit: the chain has a point
    Vec3 w;
    Vec3 weight;
    Vec3 followed;  // the part of `weight` that followed lobes alone contribute after x
    Vec3 thrown;    // the part of `weight` that x throws
    Int bounces;    // counters by kind (path/path_queue.h)
    // Behind diffuse bounces lobes are wider (shading/bsdf/filter_glossy.h). Then `weight` and `bounces` are
    // those of light that a diffuse lobe between x and the camera shows, and these those of other light, of
    // which `followed` and `thrown` are parts.
    Vec3 sharp;
    Int sharp_bounces;
};

// The surface point at the end of a chain, with its normal on the side from which the ray came.
EG_INLINE SurfacePoint chain_point(const SceneView& scene, Mask active, const Chain& c) {
    return hit_surface(scene, active & c.at.hit, c.at, c.w);
}

// Turns a surface point's normal to the side of `viewer`.
EG_INLINE void turn_to(SurfacePoint& x, Vec3 viewer) {
    const Float turned = select(dot(x.normal, viewer) < 0.0f, splat(-1.0f), 1.0f);
    x.normal = x.normal * turned;
    x.side = x.side * turned;
}

// The stride of vertex numbers, for random numbers, from one surface of a chain to the next. The numbers
// before the first surface are the segment's own. Transparent surfaces on the way to the next surface use the
// numbers in between.
constexpr int kChainVertex = 256;

// A direction in which light leaves a surface of a chain, and its density; 0: none.
struct ChainDirection {
    Vec3 w;
    Float pdf;
};

// Samples the direction by the BSDF of x, whose closure is `shader`, as if the light from `from.view` were a
// camera path. If lobes are wider behind diffuse bounces, half of the samples are those of the lobes as they
// are.
EG_OUTLINE ChainDirection sample_direction(const SceneView& scene, const SurfacePoint& x,
                                           const TexturePoint& from, const Shader& shader, Float lobe,
                                           const PathIndex& random, Int vertex) {
    const auto [u, v] = sobol_pair(random, vertex_pair(vertex, kVertexDirection));
    const Vec3 normal = shading_normal(scene, x.active, shader, from);
    const Mask lambertian = x.active & has(shader, kLambertian), others = x.active & ~lambertian;
    ChainDirection out{x.normal, splat(0.0f)};
    if (any(lambertian)) {
        const Lambertian surface{normal, x.normal, shader.color(kBaseColor)};
        const BsdfSample s = surface.sample(lambertian, lobe, u, v);
        out.w = select(s.active, s.wi, out.w);
        out.pdf = select(s.active, s.pdf, out.pdf);
    }
    if (!any(others)) return out;
    const ShadedSurface surface = shaded_surface(scene, others, x, from, shader, normal);
    const BsdfSample s = surface.sample(others, lobe, u, v);
    const Mask rough = s.active & ~s.specular;
    if (scene.least_alpha == 0.0f) {
        out.w = select(rough, s.wi, out.w);
        out.pdf = select(rough, s.pdf, out.pdf);
        return out;
    }
    const TexturePoint unblurred = without_history(from);
    const ShadedSurface sharp = shaded_surface(scene, others, x, unblurred, shader, normal);
    const BsdfSample t = sharp.sample(others, lobe, u, v);
    const Mask second = sobol_pair(random, vertex_pair(vertex, kVertexSurvival)).v < 0.5f;
    const Mask found = others & select(second, t.active & ~t.specular, rough);
    out.w = select(found, select(second, t.wi, s.wi), out.w);
    const Float density = surface.evaluate(found, out.w).pdf + sharp.evaluate(found, out.w).pdf;
    out.pdf = select(found, 0.5f * density, out.pdf);
    return out;
}

// Multiplies the parts of a chain by what x scatters of them: all lobes scatter f, of which `picked` chooses
// `others` or, if the path has had no diffuse bounce, `soft`.
EG_INLINE void scatter_parts(const SceneView& scene, const SurfacePoint& x, const TexturePoint& point,
                             const Shader& shader, Vec3 wi, Int light_kinds, Vec3 f, Vec3 soft, Vec3 others,
                             const PickedBounce& picked, bool first, const Followed& thrown, Float by_density,
                             Chain& c) {
    if (scene.followed_alpha > 0.0f) {
        const Vec3 part =
            first ? others
                  : followed_part(scene, x, point, shader, wi, light_kinds, f, splat(scene.followed_alpha));
        c.followed = c.followed * picked.of(first ? soft : zero3(), part) * by_density;
    }
    if (any(thrown.widest > 0.0f)) {
        const Vec3 part = first ? thrown_part(scene, x, point, shader, wi, light_kinds, f, thrown) : others;
        c.thrown = c.thrown * picked.of(zero3(), part) * by_density;
    }
}

// Multiplies the light of camera paths without a diffuse bounce by what x scatters to them, as seen from
// `point`: by a diffuse lobe, in front of which other lobes are wider, or by others. `behind`: the counts of
// bounces after x. `counts`: the path bounces at x. Returns the lanes with light.
EG_OUTLINE Mask scatter_sharply(const SceneView& scene, const SurfacePoint& x, const TexturePoint& point,
                                const Shader& shader, Vec3 wi, Int light_kinds, bool counts, bool first,
                                const Followed& thrown, Float choice, Int behind, Float by_density,
                                Chain& c) {
    const Vec3 f = scattered_by(scene, x, point, shader, wi, light_kinds);
    Vec3 soft = zero3(), others = f;
    PickedBounce picked{splat(0), splat(1.0f)};
    if (counts) {
        soft = scattered_by(scene, x, point, shader, wi, light_kinds & kSoftKinds);
        others = ShadedSurface::without(f, soft);
        picked = pick_bounce(soft * c.weight, others * c.sharp, choice);
    }
    const Vec3 sharp = picked.of(soft * c.weight, others * c.sharp) * by_density;
    const Mask goes = x.active & (largest_component(sharp) > 0.0f);
    if (counts)
        c.sharp_bounces =
            add_bounce(select(picked.soft, behind, c.sharp_bounces), goes, bounce_kind(x, wi, picked.soft));
    scatter_parts(scene, x, point, shader, wi, light_kinds, f, soft, others, picked, first, thrown,
                  by_density, c);
    c.sharp = sharp;
    return goes;
}

// Extends chains by one surface that rays of `seers` (bits 1 << RayKind) see. Lanes whose light leaves the
// scene, or meets only perfect lobes, become inactive. `first`: the chain ends at x, which throws what is
// `thrown` of the light. `counts`: the bounce at x counts.
EG_OUTLINE void extend(const SceneView& scene, Mask walking, Chain& chain, const PathIndex& random,
                       Int vertex, Int light_kinds, Int seers, bool counts, bool first,
                       const Followed& thrown) {
    const auto [choice, lobe] = sobol_pair(random, vertex_pair(vertex, kVertexChoice));
    const Int kind = splat(static_cast<int>(kDiffuseRay));
    const Vec3 wi = -chain.w;
    const SurfacePoint x = chain_point(scene, walking, chain);
    const TexturePoint from = texture_point(scene, x, wi, kind, behind_diffuse(scene));
    const Shader shader = surface_shader(scene, x, from, choice);
    const auto [wo, pdf] = sample_direction(scene, x, from, shader, lobe, random, vertex);

    // Evaluate the BSDF as camera paths see it.
    SurfacePoint seen = x;
    seen.active &= pdf > 0.0f;
    turn_to(seen, wo);
    const TexturePoint point = texture_point(scene, seen, wo, kind, behind_diffuse(scene));
    Shader back = closure_shader(scene, seen, shader.closure, point);
    if (scene.any_mixture) {
        // The closure was chosen with the probability of its weight from the light's side.
        const Int closures = gather(scene.material_first_closure + 1, x.material) -
                             gather(scene.material_first_closure, x.material);
        const Float here = closure_weight(scene, seen.active, shader.closure, point);
        const Float picked = closure_weight(scene, seen.active, shader.closure, from);
        back.scale = select(closures > 1, here * shader.scale / max(picked, 1e-20f), 1.0f);
    }
    Chain c = chain;
    const Vec3 f = scattered_by(scene, seen, point, back, wi, light_kinds);
    const Float by_density = abs(dot(x.normal, wo)) / max(pdf, 1e-20f);
    c.weight = c.weight * f * by_density;
    Mask active = seen.active & (largest_component(c.weight) > 0.0f);
    // Count the bounce
    Float chance = splat(0.0f);
    if (counts && any(seen.active)) {
        const Vec3 diffuse = scattered_by(scene, seen, point, back, wi, splat(1 << kDiffuseRay));
        chance = sobol_pair(random, vertex_pair(vertex, kVertexSurvival)).u;
        c.bounces = add_bounce(c.bounces, active, bounce_kind(seen, wi, f, diffuse, chance));
    }
    // Scatter the parts
    if (scene.least_alpha > 0.0f) {
        Chain parts = chain;
        active |= scatter_sharply(scene, seen, without_history(point), back, wi, light_kinds, counts, first,
                                  thrown, chance, chain.bounces, by_density, parts);
        c.sharp = parts.sharp, c.sharp_bounces = parts.sharp_bounces;
        c.followed = parts.followed, c.thrown = parts.thrown;
    } else {
        const PickedBounce all{splat(0), splat(1.0f)};
        scatter_parts(scene, seen, point, back, wi, light_kinds, f, zero3(), f, all, first, thrown,
                      by_density, c);
    }
    // Find the next surface
    const ReceiverRays rays = {splat(kScatteredRays), seers, kDiffuseRay, vertex + 1};
    const ReceiverHit next =
        find_receiver(scene, active, leave_surface(seen), -wo, ignore_nothing(), rays, random);
    Closest hit = next.hit;
    hit.hit = next.found;
    Vec3 through = next.through;
    if (scene.all_flags & kHasAbsorption)
        through = through * kept_inside(scene, seen, shader.closure, hit.distance);
    through = through * kept_by_media(scene, hit.hit, leave_surface(seen), -wo, hit.distance);
    chain.at = select(walking, hit, chain.at);
    chain.w = select(walking, wo, chain.w);
    chain.weight = select(walking, c.weight * through, chain.weight);
    chain.followed = select(walking, c.followed * through, chain.followed);
    chain.thrown = select(walking, c.thrown * through, chain.thrown);
    chain.sharp = select(walking, c.sharp * through, chain.sharp);
    chain.bounces = select(walking, c.bounces, chain.bounces);
    chain.sharp_bounces = select(walking, c.sharp_bounces, chain.sharp_bounces);
}

// The probability of one more surface in a chain, if the picture's depth allows it.
constexpr float kChainGoesOn = 0.6f;

// The number of surfaces in a sample's chain besides x, at most `most`; 0 if the camera sees x. Sets the
// probability of that number.
EG_INLINE Int chain_length(const SegmentSample& p, int most, Float& probability) {
    Float choice = sobol_pair(p.random, kPairChain).u;
    Int length = p.chained & 1;
    probability = splat(1.0f);
    for (int k = 1; k < most; ++k) {
        const Mask here = (p.chained != 0) & (length == k);
        const Mask goes_on = here & (choice < kChainGoesOn);
        choice = select(goes_on, choice * (1.0f / kChainGoesOn),
                        (choice - kChainGoesOn) * (1.0f / (1.0f - kChainGoesOn)));
        probability = select(here, probability * select(goes_on, splat(kChainGoesOn), 1.0f - kChainGoesOn),
                             probability);
        length = length + (goes_on & 1);
        if (!any(goes_on)) break;
    }
    return length;
}

// The light that x scatters, as the camera sees it.
struct SeenLight {
    Mask active;
    Projection view;
    Vec3 weight;                // W(x); without |n . D| where the camera sees x
    Vec3 scattered;             // f |n_s . w|/|n . w| of the last surface, without followed lobes
    Int bounces;                // of x and of the surfaces before it, counters by kind
    FixedDirectionChain fixed;  // near contact
};

// Takes over how the camera sees x.
EG_INLINE void take_view(const SceneView& scene, const SeenLight& seen, BoundarySegment& s) {
    s.active = seen.active;
    s.view = seen.view;
    if (scene.mesh_contact) s.fixed = seen.fixed;
    turn_to(s.x, -s.view.direction);
}

// The surfaces of a chain, x first.
struct ChainPlaces {
    Int face[kMostChain], mesh[kMostChain], instance[kMostChain];
    Float b1[kMostChain], b2[kMostChain];

    EG_INLINE void set(int k, const Closest& at) {
        face[k] = at.face, mesh[k] = at.mesh, instance[k] = at.instance;
        b1[k] = at.b1, b2[k] = at.b2;
    }
};

// Follows light of the scattering kinds `light_kinds`, which arrives at x along w, over `length` more
// surfaces to the camera. `x_goes_on`: the camera path scatters once more after x. `camera_sampled`: lanes in
// which the camera-sampled lobes of the surface that the camera sees are left out. Left out, too, is the
// contribution of followed lobes alone, which scan lines estimate (boundary/specular/chain_term.h): where the
// camera sees x, what is followed of the light (`light_followed`), and elsewhere what x throws of it
// (`thrown`), unless followed lobes show the rest of the chain. `places`, if not null, receives the surfaces
// of chains of less than kMostChain. `sharp_alone`: leaves out what diffuse lobes show.
EG_OUTLINE SeenLight see_light(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                               Mask active, const Closest& x, Vec3 w, Int length, Int light_kinds,
                               bool x_goes_on, Mask camera_sampled, const Followed& light_followed,
                               ChainPlaces* places = nullptr, const Followed& thrown = splat(0.0f),
                               bool sharp_alone = false) {
    const bool counted = kinds_matter(scene, task.limits, task.max_depth);
    const Vec3 one = {splat(1.0f), splat(1.0f), splat(1.0f)};
    const bool throws = any(thrown.widest > 0.0f);
    Chain chain{x, w, sharp_alone ? zero3() : one, one, one, splat(0), one, splat(0)};
    chain.at.hit = active;
    SeenLight seen;
    if (places) places->set(0, x);
    if (scene.mesh_contact) begin_fixed_direction_chain(scene, active, length, seen.fixed);
    // Extend the chain to a surface that the camera sees
    for (int k = 0;; ++k) {
        const Mask walking = chain.at.hit & (length > k);
        if (!any(walking)) break;
        const bool fixes = scene.mesh_contact && any(walking & (seen.fixed.length > k));
        SurfacePoint before;
        if (fixes) before = chain_point(scene, walking, chain);
        const Int seers = select(length == k + 1, splat(1 << kCameraRay), splat(kScatteredRays));
        extend(scene, walking, chain, p.random, splat((k + 1) * kChainVertex),
               k == 0 ? light_kinds : splat(kScatteredRays), seers, counted && (k > 0 || x_goes_on), k == 0,
               thrown);
        if (places && k + 1 < kMostChain) places->set(k + 1, chain.at);
        if (fixes) {
            const Mask fixed = walking & chain.at.hit & (seen.fixed.length > k);
            set_chain_surface(scene, fixed, length - (k + 1), chain_point(scene, fixed, chain), before,
                              seen.fixed);
        }
    }
    // Connect the last surface to the camera
    SurfacePoint end = chain_point(scene, chain.at.hit, chain);
    seen.view = place_in_picture(scene, end.active, end.position, p.random);
    end.active &= seen.view.active;
    turn_to(end, -seen.view.direction);
    const Float choice = sobol_pair(p.random, kPairStrategy).u;
    const Int kinds = select(length == 0, light_kinds, splat(kScatteredRays));
    const auto towards_camera = [&](Int some, Vec3* part) EG_INLINE_LAMBDA {
        return scattered_towards(scene, end, -seen.view.direction, -chain.w,
                                 splat(static_cast<int>(kCameraRay)), some, choice, camera_sampled,
                                 {task.camera_sampled, splat(task.kind == kShadowBoundary ? -1 : 0)}, part,
                                 select(length == 0, light_followed, Followed(splat(scene.followed_alpha))));
    };
    Vec3 followed = zero3();
    Vec3 f = towards_camera(kinds, scene.followed_alpha > 0.0f ? &followed : nullptr);
    end.active &= largest_component(f) > 0.0f;
    seen.scattered = scene.followed_alpha > 0.0f ? without_followed(f, followed) : f;
    // Count its bounce and test the bounce limits
    seen.bounces = chain.bounces;
    const Mask counts = counted ? x_goes_on ? end.active : end.active & (length > 0) : splat(0);
    if (any(counts)) {
        const Vec3 soft = towards_camera(kinds & kSoftKinds, nullptr);
        const Float chance = sobol_pair(p.random, vertex_pair(length, kVertexSurvival)).u;
        Int bounce = bounce_kind(end, -chain.w, f, soft, chance);
        if (scene.least_alpha > 0.0f) {
            const Vec3 others = ShadedSurface::without(f, soft);
            const PickedBounce picked = pick_bounce(soft * chain.weight, others * chain.sharp, chance);
            bounce = bounce_kind(end, -chain.w, picked.soft);
            const Mask sharp = counts & ~picked.soft;
            f = select(counts, picked.of(soft, others), f);
            followed = select(counts, picked.of(zero3(), followed), followed);
            chain.weight = select(sharp, chain.sharp, chain.weight);
            chain.thrown = select(sharp, chain.thrown, zero3());
            seen.bounces = select(sharp, chain.sharp_bounces, seen.bounces);
        }
        seen.bounces = add_bounce(seen.bounces, counts, bounce);
        end.active &= within_limits(task.limits, seen.bounces);
    }
    // Weight by visibility and by the picture's area
    if (any(end.active)) {
        const Vec3 through = seen_by_camera(scene, end.active, end, seen.view, task.limits.transparent);
        f = f * through, followed = followed * through;
    }
    const Float cosine = select(length == 0, splat(1.0f), abs(dot(end.normal, seen.view.across_of)));
    const Float area = seen.view.area * cosine;
    seen.weight = f * chain.weight * area;
    if (scene.followed_alpha > 0.0f)
        seen.weight = without_followed(seen.weight, followed * chain.followed * area);
    if (throws) {
        const Vec3 part = without_followed(f, followed) * chain.thrown * area;
        seen.weight = select(length > 0, without_followed(seen.weight, part), seen.weight);
    }
    seen.active = end.active & (largest_component(seen.weight) > 0.0f);
    return seen;
}

}  // namespace edgegrad::EDGEGRAD_ISA
