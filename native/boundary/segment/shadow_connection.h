// From a curve to both ends of a segment whose far end is a light or the environment.
#pragma once

#include "boundary/samples/direct_samples.h"
#include "boundary/segment/camera_connection.h"
#include "boundary/segment/receiver.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/segment.h"
#include "shading/lights/light_samples.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Moves y to where the segment from x meets a disk, which faces x. For spheres, drops samples of which only
// one of e and x is inside: the edge would see another side of the surface than x does.
EG_INLINE void meet_round_light(const SceneView& scene, BoundarySegment& s) {
    const Mask on_row = s.active & (s.y.row >= 0);
    const Mask disk = on_row & (s.y.kind == splat(kDiskLight));
    const Mask sphere = on_row & (s.y.kind == splat(kSphereLight));
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

// Completes a segment whose curve, light and sweep are known: finds the receiver, evaluates the light and
// follows it to the camera. `measure` is one over the density of the point on the curve. `light` has
//   blockers(), visible_to(scene, task)       the meshes that stop it and the kinds of scattering that see it
//   meet(scene, s)                            completes y, once x is known
//   arriving(scene, task, p, exit, s)         the light from y at the curve, over the density of its choice,
//                                             without its decay
// and, if samples that start at the camera estimate some of its shadows,
//   camera_sampled(task, s, chained)          lanes whose shadows in sharp lobes are left to them
//   share(scene, task, p, seen, s)            the weight beside them
template <typename Light>
EG_OUTLINE void connect_shadow(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                               const CurveExit& exit, const DerivativeView& requested, const float* adjoint,
                               Float measure, const Light& light, BoundarySegment& s) {
    // Find the receiver
    Float probability;
    const Int length = chain_length(p, task.max_depth - 2, probability);
    const Mask chained = length > 0;
    const ReceiverRays rays = receiver_rays(light.blockers(), ~chained, kShadowRay);
    const ReceiverHit receiver =
        find_receiver(scene, s.active, exit.behind, s.towards, exit.ignored, rays, p.random);
    // If x is closer to the edge than rounding, the jump is part of the primary term (derivations, F3c).
    s.reach = exit.gap + receiver.hit.distance;
    s.active &= receiver.found & (s.reach > 1e-5f * largest_component(s.point));
    if (!any(s.active)) return;
    const PlacedTriangle t = placed_triangle(scene, s.active, receiver.hit.face, receiver.hit.instance);
    s.view = place_in_picture(scene, s.active, hit_position(scene, s.active, receiver.hit, t), p.random);
    s.x = surface_point(scene, s.active & (chained | s.view.active),
                        select(s.active, receiver.hit.face, splat(0)), t, receiver.hit.b1, receiver.hit.b2,
                        s.view.direction, select(s.active, receiver.hit.instance, splat(-1)));
    s.x.mesh = receiver.hit.mesh;
    s.active = s.x.active & shines_on(scene, s.y.row, s.x.mesh, length);
    s.screen_form = s.active & ~chained;
    // Divide the segment, and skip samples that do not move
    light.meet(scene, s);
    divide_segment(s);
    fix_light_direction(scene, s);
    blend_near_contact(scene, length, s);
    s.active &= segment_moves(scene, requested, s);
    if (!task.score && any(s.active & s.screen_form))
        s.active &= ~s.screen_form | has_adjoint(scene, s.active, s.view.sx, s.view.sy, adjoint);
    if (!any(s.active)) return;

    // Evaluate the light
    const Vec3 color = receiver.through * light.arriving(scene, task, p, exit, s) * decay_along(scene, s) *
                       (measure * task.scale / probability);
    s.active &= ~(largest_component(color) == 0.0f);
    if (!any(s.active)) return;
    // Follow the light to the camera
    Mask left_out = splat(0);
    if constexpr (requires { light.camera_sampled(task, s, chained); })
        left_out = light.camera_sampled(task, s, chained);
    const Followed followed = followed_for(scene, s.active, s.y.row);
    const SeenLight seen =
        see_light(scene, task, p, s.active, receiver.hit, -s.towards, length, light.visible_to(scene, task),
                  false, left_out, followed, nullptr, thrown_of(scene, s.y.row, s.y.face, followed));
    s.view = seen.view;
    if (scene.mesh_contact) s.fixed = seen.fixed;
    s.color = color * seen.weight;
    if constexpr (requires { light.share(scene, task, p, seen, s); })
        s.color = s.color * light.share(scene, task, p, seen, s);
    s.active = seen.active & ~(largest_component(s.color) == 0.0f);
}

}  // namespace edgegrad::EDGEGRAD_ISA
