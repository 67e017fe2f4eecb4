// Indirect boundary term: an edge between two surfaces that light each other, as seen in diffuse
// interreflection, glossy reflection or through rough glass.
//
// Formula (S) of the derivations (boundary/segment/segment.h), sampled from the edge outwards (derivations,
// I). e(u) is a point of an edge, and w a direction for which all faces of the edge are on one side. y is the
// first surface along -w, and x the first surface along w:
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (de - lambda dx - (1 - lambda) dy).
// L(y) is the radiance that y scatters towards e, estimated by a path of the picture. The emission of y
// belongs to the shadow term. W(x) is the importance of light at x. If the camera sees x, it is f kappa
// |D . n|. Otherwise it is estimated by a chain of surfaces to the camera
// (boundary/segment/scattering_chain.h). Each sample chooses one length of that chain, so that each path
// length is estimated by separate samples.
//
// u is uniform on the sampled segment. w is sampled in the wedges about the edge
// (boundary/segment/silhouette.h).
#pragma once

#include "boundary/segment/far_radiance.h"
#include "boundary/segment/occluder.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/silhouette.h"
#include "tasks/boundary_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Samples the term without L(y). Appends the path that estimates L(y) to the queue of length `queued`, and
// returns the new length.
EG_OUTLINE int sample_indirect(const SceneView& scene, const BoundaryTask& task,
                               const DerivativeView& requested, int at, SegmentCursor& cursor,
                               Workspace& work, int queued, BoundarySegment& s) {
    // Sample a point of an edge
    SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    s.color = zero3();
    s.view.sx = s.view.sy = splat(kNowhere);
    s.active = p.active;
    s.edge = p.edge;
    s.instance = p.instance;
    s.u = p.u0 + (p.u1 - p.u0) * p.tau;
    s.point = p.a + p.t * s.u;
    s.y = still_far_end();
    if (scene.rays_differ)
        s.active &= (gather(scene.mesh_mask, mesh_of(scene, edge_face(scene, s.edge))) & kScatteredRays) != 0;
    // Silhouettes have a side sigma. Transparent faces have a jump of transmittance instead.
    p.active = s.active;
    const Mask clear = transparent_occluder(scene, s.active, s.edge);
    const Mask parted = parts_light(scene, clear, s.edge);
    // Sample a direction about the edge
    Float density;
    const Vec3 w = cell_direction(scene, task, p, parted, density), across = cross(p.t, w);
    density = density_about(scene, task, p, parted, w, density);
    s.towards = -w;
    const Float sigma = select(clear, splat(1.0f), occluder_side(scene, p, across));
    s.sweep = across * sigma;
    s.active &= sigma != 0.0f;
    if (!any(s.active)) return queued;

    // Find the receiver x and the surface y behind the edge
    Float probability;
    const Int length = chain_length(p, task.max_depth - 3, probability), path = lane_index() + at;
    s.screen_form = length == 0;
    const Int scattered = splat(kScatteredRays);
    const ReceiverRays rays = {scattered, select(s.screen_form, splat(1 << kCameraRay), scattered),
                               kDiffuseRay, splat(0)};
    const ReceiverHit receiver =
        find_receiver(scene, s.active, s.point, s.towards, {s.edge, s.instance}, rays, p.random);
    // If x is closer to the edge than rounding, the jump is part of the primary term (derivations, F3c).
    s.active &= receiver.found & (receiver.hit.distance > 1e-5f * largest_component(s.point));
    if (!any(s.active)) return queued;
    const LightSource y = find_source(scene, task, s, s.active, path, p.t, w);
    s.active &= y.hit.hit;
    s.reach = select(s.active, receiver.hit.distance, 1.0f);
    s.distance = y.distance;
    divide_segment(s);
    s.y.face = select(s.active, y.hit.face, splat(-1));
    s.y.instance = y.hit.instance, s.y.b1 = y.hit.b1, s.y.b2 = y.hit.b2;
    s.x = surface_point(scene, s.active, receiver.hit.face, receiver.hit.b1, receiver.hit.b2, w,
                        select(s.active, receiver.hit.instance, splat(-1)));
    s.x.mesh = receiver.hit.mesh;
    s.active = s.x.active;
    blend_near_contact(scene, length, s);
    s.active &= segment_moves(scene, requested, s);
    if (!any(s.active)) return queued;

    // Follow the light to the camera and queue the path of L(y)
    const SeenLight seen =
        see_light(scene, task, p, s.active, receiver.hit, w, length, scattered, true, splat(0));
    s.active = seen.active;
    s.view = seen.view;
    if (scene.mesh_contact) s.fixed = seen.fixed;
    turn_to(s.x, -s.view.direction);
    s.color =
        seen.weight * receiver.through * ((p.u1 - p.u0) * task.scale / (density * probability * p.density));
    if (any(clear & s.active))
        s.color = select(
            clear, s.color * transparent_jump(scene, p, s.active & clear, s.u, across, s.towards), s.color);
    if (!any(s.active)) return queued;
    return append_scattering(work, queued, s.active, path, s.point, s.towards, y.hit, y.aside, y.through,
                             y.passed, length + 2, seen.bounces, splat(static_cast<int>(kDiffuseRay)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
