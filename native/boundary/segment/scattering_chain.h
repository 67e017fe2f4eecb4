// Chains of surfaces by which the camera sees a point x that is no first hit: the light that x scatters is
// followed from surface to surface, x = x_k, x_(k-1), ..., x_1, and x_1 is connected to the camera.
//
// Light that arrives at x along w counts for the picture with (derivations, section 2)
//   W(x) = int do f |n_s . w|/|n . w| |n . o| W(x'),
// o the direction in which x scatters and x' the surface that it meets: light that is traced from its source
// meets the surfaces' true cosine where the camera's paths have that of the shading normal, hence the factor
// |n_s . w|/|n . w| (Veach 1997, section 5.3.2). The density of o is that with which the surface would
// scatter light that comes from o's side; the BSDF itself is evaluated as the camera's paths see it.
#pragma once

#include "boundary/segment/camera_connection.h"
#include "boundary/segment/receiver.h"
#include "boundary/segment/segment.h"
#include "path/path_queue.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The end of a chain so far: the point where light of `weight` arrives along w.
struct Chain {
    Closest at;  // hit: it is there
    Vec3 w;
    Vec3 weight;
    Vec3 followed;  // of the weight, what followed lobes alone bring on from the first surface
    Int bounces;    // counts by kind (path/path_queue.h)
};

// That point, its normal on the side from which the ray came that met it.
EG_INLINE SurfacePoint chain_point(const SceneView& scene, Mask active, const Chain& c) {
    SurfacePoint x = surface_point(scene, active & c.at.hit, c.at.face, c.at.b1, c.at.b2, c.w, c.at.instance);
    x.mesh = c.at.mesh;
    return x;
}

// Turns a surface point's normal to the side of `viewer`.
EG_INLINE void turn_to(SurfacePoint& x, Vec3 viewer) {
    const Float turned = select(dot(x.normal, viewer) < 0.0f, splat(-1.0f), 1.0f);
    x.normal = x.normal * turned;
    x.side = x.side * turned;
}

// The kind of bounce by which a camera's path goes on from x, seen from the side of its normal, to w, given
// the part of the light that diffuse lobes scatter.
EG_INLINE Int bounce_kind(const SurfacePoint& x, Vec3 w, Vec3 all, Vec3 diffuse, Float choice) {
    const Mask soft = choice * largest_component(all) < largest_component(diffuse);
    const Int above = select(soft, splat(static_cast<int>(kDiffuseRay)), splat(static_cast<int>(kGlossyRay)));
    return select(dot(x.normal, w) < 0.0f, splat(static_cast<int>(kTransmissionRay)), above);
}

// Whether a path of these bounces may be scattered once more.
EG_INLINE Mask within_limits(const BounceLimits& limits, Int bounces) {
    return ((bounces & 255) <= limits.diffuse) & (((bounces >> 8) & 255) <= limits.glossy) &
           (((bounces >> 16) & 255) <= limits.transmission);
}

// Where the random numbers of a chain's surface begin, by vertex: others are the segment's own, and those of
// the surfaces that let light pass on the way to the next one follow.
constexpr int kChainVertex = 256;

// One more surface, which rays of `seers` (bits 1 << RayKind) see; lanes whose light leaves the scene, or is
// reflected perfectly, become inactive. `first`: it is x.
EG_OUTLINE void extend(const SceneView& scene, Mask walking, Chain& c, const PathIndex& random, Int vertex,
                       Int light_kinds, Int seers, bool count_bounces, bool first) {
    Float choice, lobe, u, v;
    sobol_pair(random.stream, random.sample, vertex_pair(vertex, kVertexChoice), choice, lobe);
    sobol_pair(random.stream, random.sample, vertex_pair(vertex, kVertexDirection), u, v);
    const Int kind = splat(static_cast<int>(kDiffuseRay));
    const Vec3 wi = -c.w;

    // A direction, as if the light's path were one of the camera's.
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

    // What the camera's paths make of it.
    SurfacePoint seen = x;
    seen.active &= pdf > 0.0f;
    turn_to(seen, wo);
    const TexturePoint point = texture_point(scene, seen, wo, kind);
    Shader back = closure_shader(scene, seen, shader.closure, point);
    if (scene.any_mixture) {
        // The shader was picked with the probability that its weight has as seen from the light's side.
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
        followed = followed * (first ? f : followed_part(scene, seen, point, back, wi, light_kinds, f));
    const Mask active = seen.active & (largest_component(weight) > 0.0f);
    if (count_bounces && any(active)) {
        const Vec3 diffuse = scattered_by(scene, seen, point, back, wi, splat(1 << kDiffuseRay));
        Float chance, unused;
        sobol_pair(random.stream, random.sample, vertex_pair(vertex, kVertexSurvival), chance, unused);
        c.bounces = add_bounce(c.bounces, active, bounce_kind(seen, wi, f, diffuse, chance));
    }
    const LightsWay way = {splat(kScatteredRays), seers, kDiffuseRay, vertex + 1};
    const LitPoint next =
        find_receiver(scene, active, leave_surface(seen), -wo, ignore_nothing(), way, random);
    const Closest& hit = next.hit;
    c.at.hit = select(walking, next.found, c.at.hit);
    c.at.face = select(walking, hit.face, c.at.face);
    c.at.mesh = select(walking, hit.mesh, c.at.mesh);
    c.at.instance = select(walking, hit.instance, c.at.instance);
    c.at.b1 = select(walking, hit.b1, c.at.b1);
    c.at.b2 = select(walking, hit.b2, c.at.b2);
    c.at.distance = select(walking, hit.distance, c.at.distance);
    c.w = select(walking, wo, c.w);
    c.weight = select(walking, weight * next.through, c.weight);
    c.followed = select(walking, followed * next.through, c.followed);
}

// The share of chains that go on once more, if the picture's depth lets them.
constexpr float kChainGoesOn = 0.6f;

// Surfaces of a sample's chain besides x, 0 of those whose x the camera sees, at most `most`; the probability
// of that number.
EG_INLINE Int chain_length(const SegmentSample& p, int most, Float& probability) {
    Float choice, unused;
    sobol_pair(p.random.stream, p.random.sample, kPairChain, choice, unused);
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

// Whether limits of bounces may end paths before their depth does.
EG_INLINE bool limits_matter(const BoundaryTask& task) {
    const int most = task.max_depth - 2;
    return task.limits.diffuse < most || task.limits.glossy < most || task.limits.transmission < most;
}

// Whether paths that lobes of `kinds` scatter at x, the vertex of these random numbers, towards w may go on;
// then counts the bounce. evaluate(kinds): the lobes' value.
template <typename Value>
EG_INLINE Mask scatters_within_limits(const BoundaryTask& task, Mask active, const SurfacePoint& x, Vec3 w,
                                      Int kinds, const PathIndex& random, Int vertex, const Value& evaluate,
                                      Int& bounces) {
    if (!limits_matter(task) || !any(active)) return active;
    Float choice, unused;
    sobol_pair(random.stream, random.sample, vertex_pair(vertex, kVertexSurvival), choice, unused);
    const Vec3 all = evaluate(kinds), diffuse = evaluate(kinds & (1 << kDiffuseRay));
    bounces = add_bounce(bounces, active, bounce_kind(x, w, all, diffuse, choice));
    return active & within_limits(task.limits, bounces);
}

// How the camera sees the light that x scatters.
struct SeenLight {
    Mask active;
    Projection view;
    Vec3 weight;               // W(x); where the camera sees x itself, but for |n . D|
    Int bounces;               // of x and of the surfaces before it, counts by kind
    FixedDirectionChain held;  // where light is held
};

// Light that arrives along w at x, of the kinds `light_kinds` of scattering, is followed over `length` more
// surfaces to the camera. `x_goes_on`: the camera's path is scattered once more behind x. Left out is what
// followed lobes alone bring (boundary/specular/chain_term.h), but for light `of_table` where the camera sees
// x: that has no edges.
EG_OUTLINE SeenLight see_light(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                               Mask active, const Closest& x, Vec3 w, Int length, Int light_kinds,
                               bool x_goes_on, Mask of_table) {
    const bool limited = limits_matter(task);
    const Vec3 one = {splat(1.0f), splat(1.0f), splat(1.0f)};
    Chain chain{x, w, one, one, splat(0)};
    chain.at.hit = active;
    SeenLight seen;
    if (scene.mesh_contact) begin_fixed_direction_chain(scene, active, length, seen.held);
    for (int k = 0;; ++k) {
        const Mask walking = chain.at.hit & (length > k);
        if (!any(walking)) break;
        const bool holds = scene.mesh_contact && any(walking & (seen.held.length > k));
        SurfacePoint before;
        if (holds) before = chain_point(scene, walking, chain);
        const Int seers = select(length == k + 1, splat(1 << kCameraRay), splat(kScatteredRays));
        extend(scene, walking, chain, p.random, splat((k + 1) * kChainVertex),
               k == 0 ? light_kinds : splat(kScatteredRays), seers, limited && (k > 0 || x_goes_on), k == 0);
        if (holds) {
            const Mask held = walking & chain.at.hit & (seen.held.length > k);
            hold_next(scene, held, length - (k + 1), chain_point(scene, held, chain), before, seen.held);
        }
    }
    SurfacePoint end = chain_point(scene, chain.at.hit, chain);
    seen.view = place_in_picture(scene, end.active, end.position, p.random);
    end.active &= seen.view.active;
    turn_to(end, -seen.view.direction);
    Float choice, unused;
    sobol_pair(p.random.stream, p.random.sample, kPairStrategy, choice, unused);
    const Int kind = splat(static_cast<int>(kCameraRay));
    const Int kinds = select(length == 0, light_kinds, splat(kScatteredRays));
    Vec3 followed = zero3();
    Vec3 f = scattered_towards(scene, end, -seen.view.direction, -chain.w, kind, kinds, choice,
                               x_goes_on ? task.camera_sampled_alpha : 0.0f,
                               scene.followed_alpha > 0.0f ? &followed : nullptr);
    end.active &= largest_component(f) > 0.0f;
    seen.bounces = chain.bounces;
    const Mask counts = x_goes_on ? end.active : end.active & (length > 0);
    if (limited && any(counts)) {
        const Vec3 soft = scattered_towards(scene, end, -seen.view.direction, -chain.w, kind,
                                            splat(1 << kDiffuseRay), choice);
        Float chance;
        sobol_pair(p.random.stream, p.random.sample, vertex_pair(length, kVertexSurvival), chance, unused);
        seen.bounces = add_bounce(seen.bounces, counts, bounce_kind(end, -chain.w, f, soft, chance));
        end.active &= within_limits(task.limits, seen.bounces);
    }
    if (any(end.active)) {
        const Vec3 through = seen_by_camera(scene, end.active, end, seen.view, task.limits.transparent);
        f = f * through, followed = followed * through;
    }
    const Float cosine = select(length == 0, splat(1.0f), abs(dot(end.normal, seen.view.across_of)));
    const Float area = seen.view.area * cosine;
    seen.weight = f * chain.weight * area;
    if (scene.followed_alpha > 0.0f)
        seen.weight = select((length == 0) & of_table, seen.weight,
                             without_followed(seen.weight, followed * chain.followed * area));
    seen.active = end.active & (largest_component(seen.weight) > 0.0f);
    return seen;
}

}  // namespace edgegrad::EDGEGRAD_ISA
