// Shadow boundary term: an edge between a receiver and its light.
//
// Formula (S) of the derivations (boundary/segment/segment.h), sampled from the edge outwards (derivations,
// C2, D and E). e(u) is a point of an edge, y a point of a light, and x the first surface behind e along w,
// the direction of light from y:
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (de - lambda dx - (1 - lambda) dy).
// If the camera sees x, W(x) = kappa |n . D| f, with f the BSDF of x towards the camera (times
// |n_s . w|/|n . w| for another shading normal). Otherwise W(x) is estimated by a chain of surfaces to the
// camera (boundary/segment/scattering_chain.h). sigma is the side of the edge's faces. If they are on both
// sides, no light passes the edge. For lights without size, L dw is I/|e - y|^2, or a sun's irradiance.
//
// u is uniform on the sampled segment. The picture's light samplers choose y as they would at a surface in e,
// with densities per solid angle dw (shading/lights/lights.h). Directions to the environment are sampled
// about the edge and by the environment's image.
#pragma once

#include "boundary/samples/direct_samples.h"
#include "boundary/segment/camera_connection.h"
#include "boundary/segment/occluder.h"
#include "boundary/segment/receiver.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/segment.h"
#include "boundary/segment/silhouette.h"
#include "shading/lights/environment_samples.h"
#include "shading/lights/light_radiance.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Samples a direction to the environment from a point of an edge: in the wedges where the edge is a
// silhouette or, half of the time, by the environment's image. The weight uses the density of the mixture
// (balance heuristic).
EG_INLINE Vec3 environment_direction(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                                     Mask parted, Float& density) {
    constexpr float kByImage = 0.5f;
    Vec3 towards = cell_direction(scene, task, p, parted, density);
    if (scene.environment_image.sampled) {
        Float pick, unused, image_u, image_v;
        sobol_pair(p.random.stream, p.random.sample, kPairStrategy, unused, pick);
        sobol_pair(p.random.stream, p.random.sample, kPairLight, image_u, image_v);
        const Mask by_image = pick < kByImage;
        towards = select(by_image, sample_environment(scene, p.active, image_u, image_v).w, towards);
        density = (1.0f - kByImage) * density_about(scene, task, p, parted, towards, density) +
                  kByImage * environment_pdf(scene, towards);
        return towards;
    }
    density = density_about(scene, task, p, parted, towards, density);
    return towards;
}

EG_OUTLINE LightSample sample_passing_light(const SceneView& scene, Mask active, const TransparentEdge& edge,
                                            Float u, Float v) {
    return sample_light_for(scene, active, edge, u, v);
}

// The light of a shadow sample. Its radiance is evaluated only after the sample is known to contribute.
struct ShadowLight {
    LightSample sample;
    Float geometry;  // 1/density
    Int blockers;
};

// Samples the light and sets y.
EG_INLINE ShadowLight sample_light_point(const SceneView& scene, const BoundaryTask& task,
                                         const SegmentSample& p, Mask parted, BoundarySegment& s) {
    ShadowLight light;
    if (task.kind == kEnvironmentShadow) {
        Float density;
        s.towards = environment_direction(scene, task, p, parted, density);
        s.distance = splat(__builtin_inff());
        s.y.environment = splat(scene.environment_image.pixels ? -1 : 0);
        light.geometry = 1.0f / max(density, 1e-30f);
        light.blockers = splat(scene.environment_image.sampled ? 1 << kShadowRay : 1 << kDiffuseRay);
        return light;
    }
    Float u, v;
    sobol_pair(p.random.stream, p.random.sample, kPairLight, u, v);
    light.sample = sample_passing_light(scene, p.active, {s.point, s.edge}, u, v);
    const LightSample& from = light.sample;
    s.active &= from.active & from.casts_shadow;
    s.towards = from.w;
    s.distance = from.r;
    s.y.face = from.face, s.y.b1 = from.b1, s.y.b2 = from.b2;
    s.y.row = from.row, s.y.kind = from.kind;
    light.geometry = from.geometry;
    light.blockers = from.blockers;
    return light;
}

// Moves y to where the segment from x meets a disk, which faces x. For spheres, drops samples of which only
// one of e and x is inside: the edge would see another side of the surface than x does.
EG_INLINE void meet_round_light(const SceneView& scene, BoundarySegment& s) {
    const Mask on_row = s.active & (s.y.row >= 0);
    const Mask disk = on_row & (s.y.kind == splat(static_cast<int>(kDiskLight)));
    const Mask sphere = on_row & (s.y.kind == splat(static_cast<int>(kSphereLight)));
    if (!any(disk | sphere)) return;
    const LightRow l = gather_light(scene.lights, select(disk | sphere, s.y.row, splat(0)));
    Float pdf;
    if (any(disk)) {
        const Float way = meet_light(l, kDiskLight, s.x.position, s.towards, pdf);
        s.distance = select(disk, way - s.reach, s.distance);
        s.active &= ~disk | (s.distance > 0.0f);
    }
    const auto within = [&](Vec3 at) {
        const Vec3 way = at - l.position;
        return dot(way, way) <= l.radius * l.radius;
    };
    s.active &= ~sphere | (within(s.point) == within(s.x.position));
}

// The light that arrives at the edge from y, over the density of the sample.
EG_INLINE Vec3 light_at_edge(const SceneView& scene, const BoundaryTask& task, const BoundarySegment& s,
                             ShadowLight& light) {
    PassingRays rays{light.blockers};
    rays.ignored = {s.edge, s.instance};
    if (task.kind == kEnvironmentShadow)
        return environment_radiance(scene, s.towards) * light.geometry *
               transmittance(scene, s.active, s.point, s.towards, splat(__builtin_inff()), rays);
    light.sample.active = s.active;
    look_up_emission(scene, light.sample);
    const Mask near = s.distance < __builtin_inff(), on_surface = light.sample.face >= 0;
    const Vec3 end =
        select(on_surface, light.sample.end - s.point, s.towards * select(near, s.distance, 1.0f));
    const Float far = select(near, splat(0.99999f), splat(__builtin_inff()));
    return light.sample.radiance * light.geometry * transmittance(scene, s.active, s.point, end, far, rays);
}

EG_OUTLINE BoundarySegment sample_shadow(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                         SegmentCursor& cursor, const DerivativeView& requested,
                                         const float* adjoint) {
    BoundarySegment s;
    // Sample a point of an edge and a light
    SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    s.active = p.active;
    s.edge = p.edge;
    s.instance = p.instance;
    s.u = p.u0 + (p.u1 - p.u0) * p.tau;
    s.point = p.a + p.t * s.u;
    s.y = still_far_end();
    s.view.sx = s.view.sy = splat(0.0f);
    // Silhouettes have a side sigma. Transparent faces have a jump of transmittance instead.
    const Mask clear = transparent_occluder(scene, s.active, s.edge);
    ShadowLight light = sample_light_point(scene, task, p, parts_light(scene, clear, s.edge), s);
    if (scene.rays_differ || scene.lights.any_linked) {
        Int mesh = mesh_of(scene, edge_face(scene, s.edge));
        s.active &= (gather(scene.mesh_mask, mesh) & light.blockers) != 0;
    }
    // Skip edges that are no silhouette in this direction
    const Vec3 across = cross(p.t, -s.towards);
    p.active = s.active;
    const Float sigma = select(clear, splat(1.0f), occluder_side(scene, p, across));
    s.sweep = across * sigma;
    s.active &= sigma != 0.0f;
    if (!any(s.active)) return s;

    // Find the receiver
    Float probability;
    const Int length = chain_length(p, task.max_depth - 2, probability);
    const Mask chained = length > 0;
    const ReceiverRays rays = {light.blockers, select(chained, splat(kScatteredRays), splat(1 << kCameraRay)),
                               kShadowRay, splat(0)};
    const ReceiverHit receiver =
        find_receiver(scene, s.active, s.point, s.towards, {s.edge, s.instance}, rays, p.random);
    // If x is closer to the edge than rounding, the jump is part of the primary term (derivations, F3c).
    s.active &= receiver.found & (receiver.hit.distance > 1e-5f * largest_component(s.point));
    if (!any(s.active)) return s;
    s.reach = receiver.hit.distance;
    const PlacedTriangle t = placed_triangle(scene, select(s.active, receiver.hit.face, splat(0)),
                                             select(s.active, receiver.hit.instance, splat(-1)));
    s.view = place_in_picture(scene, s.active, hit_position(scene, s.active, receiver.hit, t), p.random);
    s.x = surface_point(scene, s.active & (chained | s.view.active),
                        select(s.active, receiver.hit.face, splat(0)), t, receiver.hit.b1, receiver.hit.b2,
                        s.view.direction, select(s.active, receiver.hit.instance, splat(-1)));
    s.x.mesh = receiver.hit.mesh;
    s.active = s.x.active & shines_on(scene, s.y.row, s.x.mesh);
    s.screen_form = s.active & ~chained;
    // Divide the segment, and skip samples that do not move
    meet_round_light(scene, s);
    divide_segment(s);
    fix_light_direction(scene, s);
    blend_near_contact(scene, length, s);
    s.active &= segment_moves(scene, requested, s);
    if (!task.score && any(s.active & s.screen_form))
        s.active &= ~s.screen_form | has_adjoint(scene, s.active, s.view.sx, s.view.sy, adjoint);
    if (!any(s.active)) return s;

    // Evaluate the light
    Vec3 color = receiver.through * light_at_edge(scene, task, s, light) * decay_along(scene, s) *
                 ((p.u1 - p.u0) * task.scale / (p.density * probability));
    if (any(clear))
        color = select(clear, color * transparent_jump(scene, p, s.active & clear, s.u, across, s.towards),
                       color);
    s.active &= ~(largest_component(color) == 0.0f);
    if (!any(s.active)) return s;
    // Follow the light to the camera
    const Int kinds =
        task.kind == kEnvironmentShadow ? splat(scene.environment_mask) : light.sample.visible_to;
    const SeenLight seen =
        see_light(scene, task, p, s.active, receiver.hit, -s.towards, length, kinds, false, s.y.row >= 0);
    s.view = seen.view;
    if (scene.mesh_contact) s.fixed = seen.fixed;
    s.color = color * seen.weight;
    s.active = seen.active & ~(largest_component(s.color) == 0.0f);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
