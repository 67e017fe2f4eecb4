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
#include "boundary/segment/receiver.h"
#include "boundary/segment/segment.h"
#include "path/bounces.h"
#include "path/path_queue.h"
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

// The kind of bounce by which a camera path continues from x to w, with x seen from the side of its normal.
// `diffuse` is the part of the scattered light `all` that is due to diffuse lobes.
EG_INLINE Int bounce_kind(const SurfacePoint& x, Vec3 w, Vec3 all, Vec3 diffuse, Float choice) {
    const Mask soft = choice * largest_component(all) < largest_component(diffuse);
    const Int above = select(soft, splat(static_cast<int>(kDiffuseRay)), splat(static_cast<int>(kGlossyRay)));
    return select(dot(x.normal, w) < 0.0f, splat(static_cast<int>(kTransmissionRay)), above);
}

// Whether a path with these bounces may scatter once more.
EG_INLINE Mask within_limits(const BounceLimits& limits, Int bounces) {
    return ((bounces & 255) <= limits.diffuse) & (((bounces >> 8) & 255) <= limits.glossy) &
           (((bounces >> 16) & 255) <= limits.transmission) & ~finds_ambient(limits, bounces);
}

// The stride of vertex numbers, for random numbers, from one surface of a chain to the next. The numbers
// before the first surface are the segment's own. Transparent surfaces on the way to the next surface use the
// numbers in between.
constexpr int kChainVertex = 256;

// Extends chains by one surface that rays of `seers` (bits 1 << RayKind) see. Lanes whose light leaves the
// scene, or meets only perfect lobes, become inactive. `first`: the chain ends at x, which throws what is
// `thrown` of the light.
EG_OUTLINE void extend(const SceneView& scene, Mask walking, Chain& c, const PathIndex& random, Int vertex,
                       Int light_kinds, Int seers, bool count_bounces, bool first, const Followed& thrown) {
    const auto [choice, lobe] = sobol_pair(random, vertex_pair(vertex, kVertexChoice));
    const auto [u, v] = sobol_pair(random, vertex_pair(vertex, kVertexDirection));
    const Int kind = splat(static_cast<int>(kDiffuseRay));
    const Vec3 wi = -c.w;

    // Sample a direction by the BSDF, as if the light were a camera path.
    const SurfacePoint x = chain_point(scene, walking, c);
    const TexturePoint from = texture_point(scene, x, wi, kind);
    const Shader shader = surface_shader(scene, x, from, choice);
    const Vec3 normal = shading_normal(scene, x.active, shader, from);
    const Mask lambertian = x.active & has(shader, kLambertian), others = x.active & ~lambertian;
    Vec3 wo = x.normal;
    Float pdf = splat(0.0f);
    if (any(lambertian)) {
        const Lambertian surface{normal, x.normal, shader.color(kBaseColor)};
        const BsdfSample s = surface.sample(lambertian, lobe, u, v);
        wo = select(s.active, s.wi, wo);
        pdf = select(s.active, s.pdf, pdf);
    }
    if (any(others)) {
        const BsdfSample s =
            shaded_surface(scene, others, x, from, shader, normal).sample(others, lobe, u, v);
        const Mask rough = s.active & ~s.specular;
        wo = select(rough, s.wi, wo);
        pdf = select(rough, s.pdf, pdf);
    }

    // Evaluate the BSDF as camera paths see it.
    SurfacePoint seen = x;
    seen.active &= pdf > 0.0f;
    turn_to(seen, wo);
    const TexturePoint point = texture_point(scene, seen, wo, kind);
    Shader back = closure_shader(scene, seen, shader.closure, point);
    if (scene.any_mixture) {
        // The closure was chosen with the probability of its weight from the light's side.
        const Int closures = gather(scene.material_first_closure + 1, x.material) -
                             gather(scene.material_first_closure, x.material);
        const Float here = closure_weight(scene, seen.active, shader.closure, point);
        const Float picked = closure_weight(scene, seen.active, shader.closure, from);
        back.scale = select(closures > 1, here * shader.scale / max(picked, 1e-20f), 1.0f);
    }
    const Vec3 f = scattered_by(scene, seen, point, back, wi, light_kinds);
    const Float by_density = abs(dot(x.normal, wo)) / max(pdf, 1e-20f);
    const Vec3 weight = c.weight * f * by_density;
    Vec3 followed = c.followed * by_density;
    if (scene.followed_alpha > 0.0f)
        followed = followed * (first ? f
                                     : followed_part(scene, seen, point, back, wi, light_kinds, f,
                                                     splat(scene.followed_alpha)));
    Vec3 throws = c.thrown * by_density;
    if (any(thrown.widest > 0.0f))
        throws = throws * (first ? thrown_part(scene, seen, point, back, wi, light_kinds, f, thrown) : f);
    // Count the bounce
    const Mask active = seen.active & (largest_component(weight) > 0.0f);
    if (count_bounces && any(active)) {
        const Vec3 diffuse = scattered_by(scene, seen, point, back, wi, splat(1 << kDiffuseRay));
        const Float chance = sobol_pair(random, vertex_pair(vertex, kVertexSurvival)).u;
        c.bounces = add_bounce(c.bounces, active, bounce_kind(seen, wi, f, diffuse, chance));
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
    c.at = select(walking, hit, c.at);
    c.w = select(walking, wo, c.w);
    c.weight = select(walking, weight * through, c.weight);
    c.followed = select(walking, followed * through, c.followed);
    c.thrown = select(walking, throws * through, c.thrown);
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

// Whether paths may continue after lobes of `kinds` scatter them at x towards w; counts the bounce. `vertex`
// selects the random numbers of x, and evaluate(kinds) returns the value of lobes.
template <typename Value>
EG_INLINE Mask scatters_within_limits(const BoundaryTask& task, Mask active, const SurfacePoint& x, Vec3 w,
                                      Int kinds, const PathIndex& random, Int vertex, const Value& evaluate,
                                      Int& bounces) {
    if (!limits_matter(task.limits, task.max_depth) || !any(active)) return active;
    const Float choice = sobol_pair(random, vertex_pair(vertex, kVertexSurvival)).u;
    const Vec3 all = evaluate(kinds), diffuse = evaluate(kinds & (1 << kDiffuseRay | kOfTable));
    bounces = add_bounce(bounces, active, bounce_kind(x, w, all, diffuse, choice));
    return active & within_limits(task.limits, bounces);
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
// of chains of less than kMostChain.
EG_OUTLINE SeenLight see_light(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                               Mask active, const Closest& x, Vec3 w, Int length, Int light_kinds,
                               bool x_goes_on, Mask camera_sampled, const Followed& light_followed,
                               ChainPlaces* places = nullptr, const Followed& thrown = splat(0.0f)) {
    const bool limited = limits_matter(task.limits, task.max_depth);
    const Vec3 one = {splat(1.0f), splat(1.0f), splat(1.0f)};
    const bool throws = any(thrown.widest > 0.0f);
    Chain chain{x, w, one, one, one, splat(0)};
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
               k == 0 ? light_kinds : splat(kScatteredRays), seers, limited && (k > 0 || x_goes_on), k == 0,
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
    const Int kind = splat(static_cast<int>(kCameraRay));
    const Int kinds = select(length == 0, light_kinds, splat(kScatteredRays));
    Vec3 followed = zero3();
    Vec3 f =
        scattered_towards(scene, end, -seen.view.direction, -chain.w, kind, kinds, choice, camera_sampled,
                          {task.camera_sampled, splat(task.kind == kShadowBoundary ? -1 : 0)},
                          scene.followed_alpha > 0.0f ? &followed : nullptr,
                          select(length == 0, light_followed, Followed(splat(scene.followed_alpha))));
    end.active &= largest_component(f) > 0.0f;
    // Count its bounce and test the bounce limits
    seen.bounces = chain.bounces;
    const Mask counts = x_goes_on ? end.active : end.active & (length > 0);
    if (limited && any(counts)) {
        const Vec3 soft = scattered_towards(scene, end, -seen.view.direction, -chain.w, kind,
                                            splat(1 << kDiffuseRay), choice);
        const Float chance = sobol_pair(p.random, vertex_pair(length, kVertexSurvival)).u;
        seen.bounces = add_bounce(seen.bounces, counts, bounce_kind(end, -chain.w, f, soft, chance));
        end.active &= within_limits(task.limits, seen.bounces);
    }
    seen.scattered = scene.followed_alpha > 0.0f ? without_followed(f, followed) : f;
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
