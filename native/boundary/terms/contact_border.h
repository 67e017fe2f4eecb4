// Borders of faces near contact: light of a fixed direction moves over them.
//
// Near contact the point y of a face keeps its direction from x with the weight b (scene/contact.h). Borders
// of the face, which move with their edge, then move over y. With L+ and L- the radiance towards x of the
// nearest of the edge's faces on the sides of +-(t x w), and b+ and b- their weights at e,
//   dI = int du int dw  W(x) (b- L- - b+ L+) (t x w) . (de - dx)      (derivations, C5).
// A face on one side alone is that of an outline; what is behind belongs to other terms. Where two faces of a
// smooth surface meet, both sides nearly cancel, because their paths have the same random numbers.
//
// e(u) is uniform on the sampled segment. Half of the directions w are those in which the edge is a
// silhouette (boundary/segment/silhouette.h): there one side alone counts. The others are uniform on the
// sphere. From there on this is an indirect segment (boundary/terms/indirect.h) with y at e.
#pragma once

#include "boundary/segment/far_radiance.h"
#include "boundary/segment/receiver.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/silhouette.h"
#include "tasks/boundary_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// The edge as seen from x, by rays along `direction`.
EG_INLINE EdgeSample seen_edge(const SegmentSample& p, const BoundarySegment& s, Vec3 direction) {
    EdgeSample e;
    e.active = s.active, e.edge = s.edge, e.instance = s.instance;
    e.intersection = splat(0);
    e.u = s.u, e.point = s.point, e.tangent = p.t, e.end = p.a;
    e.view.across_of = direction;
    e.normal = cross(direction, p.t);
    return e;
}

// Appends the path of the light that one side of the edge scatters towards x, times b.
EG_INLINE int append_side(const SceneView& scene, Workspace& work, int queued, const EdgeSample& e,
                          const BoundarySegment& s, const SideFace& side, Float blend, Int path, Int segment,
                          Int bounces) {
    const Mask active = s.active & (blend > 0.0f);
    if (!any(active)) return queued;
    Closest y;
    y.hit = active;
    y.face = select(active, side.face, splat(0));
    y.instance = select(active, side.instance, splat(-1));
    y.mesh = mesh_of(scene, y.face);
    y.distance = splat(0.0f);
    SideFace near = side;
    near.face = select(active, side.face, splat(-1));
    const Vec3 step = near_point(scene, e, near, e.normal, y.b1, y.b2);
    const Vec3 kept = kept_before_start(scene, active, y, s.point, s.towards, s.reach) * blend;
    return append_scattering(work, queued, active, path, s.point, s.towards, y, step, kept, splat(0), segment,
                             bounces, splat(kDiffuseRay));
}

// Samples the term without L+ and L-.
EG_OUTLINE int sample_border(const SceneView& scene, const BoundaryTask& task,
                             const DerivativeView& requested, int at, SegmentCursor& cursor, Workspace& work,
                             int queued, BoundarySegment& s) {
    // Sample a point of an edge and a direction
    SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    begin_segment(p, s);
    Float density;
    p.active = s.active;
    const Vec3 w = cell_direction(scene, task, p, s.active, density);
    density = density_about(scene, task, p, s.active, w, density);
    s.towards = -w;
    s.sweep = cross(p.t, w);
    s.distance = splat(0.0f), s.lambda = splat(1.0f);
    EdgeSample e = seen_edge(p, s, s.towards);
    const Sides sides = visible_faces(scene, e);
    s.active &= (sides.plus.face >= 0) | (sides.minus.face >= 0);
    if (!any(s.active)) return queued;

    // Find the receiver x
    Float probability;
    const Int length = chain_length(p, task.max_depth - 3, probability);
    s.active &= length < scene.fixed_direction_surfaces;
    s.screen_form = length == 0;
    const Int scattered = splat(kScatteredRays);
    const ReceiverRays rays = receiver_rays(scattered, s.screen_form, kDiffuseRay);
    const ReceiverHit receiver =
        find_receiver(scene, s.active, s.point, s.towards, {s.edge, s.instance}, rays, p.random);
    s.active &= receiver.found & (receiver.hit.distance > 1e-5f * largest_component(s.point));
    if (!any(s.active)) return queued;
    s.reach = select(s.active, receiver.hit.distance, 1.0f);
    s.x = hit_surface(scene, s.active, receiver.hit, w);
    s.active = s.x.active & segment_moves(scene, requested, s);

    // Weigh both sides
    e.active = s.active;
    const auto blend_of = [&](const SideFace& side) EG_INLINE_LAMBDA {
        const Mask there = s.active & (side.face >= 0);
        const Int face = select(there, side.face, splat(0)), mesh = mesh_of(scene, face);
        const Mask sampled =
            there & may_blend(scene, there, s.x.mesh, mesh) &
            borders_are_sampled(scene, gather(scene.mesh_contact, select(there, s.x.mesh, splat(0))),
                                gather(scene.mesh_contact, mesh));
        if (!any(sampled)) return splat(0.0f);
        const Int instance = select(sampled, side.instance, splat(-1));
        const Triangle t = placed_triangle(scene, face, instance).triangle;
        return contact(scene, sampled, s.x.mesh, s.x.position, s.x.normal, mesh, face, instance, t, s.point)
            .share;
    };
    const Float plus = blend_of(sides.plus), minus = blend_of(sides.minus);
    s.active &= (plus > 0.0f) | (minus > 0.0f);
    if (!any(s.active)) return queued;

    // Follow the light to the camera
    const SeenLight seen = see_light(scene, task, p, s.active, receiver.hit, w, length, scattered, true,
                                     splat(0), splat(scene.followed_alpha));
    take_view(scene, seen, s);
    s.color =
        seen.weight * receiver.through * ((p.u1 - p.u0) * task.scale / (density * probability * p.density));
    // Queue the paths of both sides
    e.active = s.active;
    const Int path = lane_index() + at, count = splat(static_cast<int>(task.count));
    queued = append_side(scene, work, queued, e, s, sides.minus, minus, path, length + 2, seen.bounces);
    return append_side(scene, work, queued, e, s, sides.plus, plus, path + count, length + 2, seen.bounces);
}

}  // namespace edgegrad::EDGEGRAD_ISA
