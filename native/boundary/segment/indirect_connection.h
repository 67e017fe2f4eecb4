// From a curve to both ends of a segment whose far end is a surface that scatters light.
#pragma once

#include "boundary/segment/far_radiance.h"
#include "boundary/segment/scattering_chain.h"
#include "tasks/boundary_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Completes a segment whose curve, direction and sweep are known, without L(y): finds the receiver x and the
// source y = find(path) and follows the light to the camera. Appends the path that estimates L(y) to the
// queue of length `queued`, and returns the new length. `measure` is one over the density of the point on the
// curve and of the direction. jump() multiplies the light.
template <typename Find, typename Jump>
EG_OUTLINE int connect_indirect(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                                const CurveExit& exit, const DerivativeView& requested, Float measure, int at,
                                Workspace& work, int queued, const Find& find, const Jump& jump,
                                BoundarySegment& s) {
    // Find the receiver x and the surface y behind the edge
    const Vec3 w = -s.towards;
    Float probability;
    const Int length = chain_length(p, task.max_depth - 3, probability), path = lane_index() + at;
    s.screen_form = length == 0;
    const Int scattered = splat(kScatteredRays);
    const ReceiverRays rays = receiver_rays(scattered, s.screen_form, kDiffuseRay);
    const ReceiverHit receiver =
        find_receiver(scene, s.active, exit.behind, s.towards, exit.ignored, rays, p.random);
    // If x is closer to the edge than rounding, the jump is part of the primary term (derivations, F3c).
    s.reach = exit.gap + receiver.hit.distance;
    s.active &= receiver.found & (s.reach > 1e-5f * largest_component(s.point));
    if (!any(s.active)) return queued;
    const LightSource y = find(path);
    s.active &= y.hit.hit;
    s.reach = select(s.active, s.reach, 1.0f);
    s.distance = y.distance;
    divide_segment(s);
    s.y.face = select(s.active, y.hit.face, splat(-1));
    s.y.instance = y.hit.instance, s.y.b1 = y.hit.b1, s.y.b2 = y.hit.b2;
    s.x = hit_surface(scene, s.active, receiver.hit, w);
    s.active = s.x.active;
    blend_near_contact(scene, length, s);
    s.active &= segment_moves(scene, requested, s);
    if (!any(s.active)) return queued;

    // Follow the light to the camera and queue the path of L(y)
    const SeenLight seen = see_light(scene, task, p, s.active, receiver.hit, w, length, scattered, true,
                                     splat(-1), splat(scene.followed_alpha));
    take_view(scene, seen, s);
    s.color = seen.weight * receiver.through * (measure * task.scale / probability);
    jump();
    if (!any(s.active)) return queued;
    return append_scattering(
        work, queued, s.active, path, s.point, s.towards, y.hit, y.aside,
        y.through * kept_before_start(scene, s.active, y.hit, s.point, s.towards, s.reach), y.passed,
        length + 2, seen.bounces, splat(kDiffuseRay));
}

}  // namespace edgegrad::EDGEGRAD_ISA
