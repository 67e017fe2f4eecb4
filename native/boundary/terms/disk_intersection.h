// Intersections with disk lights, which face the point x that they light: the part of the disk that a surface
// occludes.
//
// The line along which a face intersects such a disk depends on x, so samples start at the camera. A path of
// the picture leads to its k-th vertex x, with throughput beta. Then a point q(u) is sampled on the line
// along which the face intersects the disk that faces x, uniformly in u (boundary/samples/light_cut.h). With
// r = |x - q|, where 1/r^2 converts the solid angle (derivations, C1 and F2),
//   dI = int ds beta sum over faces int du  f |n_s . w|/r^2 L sigma (t x w) . (dq - dy).
// y moves with the disk, which turns with x, so dy depends on dx.
#pragma once

#include "boundary/samples/direct_samples.h"
#include "boundary/terms/camera_sampled.h"
#include "boundary/terms/intersection.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

struct DiskSegment : IntersectionSegment {};

// The task's samples as paths of the picture.
EG_INLINE ImageTask disk_paths(const BoundaryTask& task) {
    return sample_paths(task, 1, hash(task.seed ^ 0x3ad8025fu));
}

EG_OUTLINE DiskSegment sample_disk_intersection(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                                SegmentCursor& cursor, const DerivativeView& motion,
                                                const float* adjoint) {
    DiskSegment s;
    // Follow a path of the picture to x
    PicturePath begun = start_in_picture(scene, task, at, cursor, task.max_depth - 2, s);
    const SegmentSample& p = begun.segment;
    PathPacket& path = begun.path;
    const ImageTask walks = disk_paths(task);
    if (scene.mesh_contact) begin_fixed_direction_chain(scene, path.active, begun.length, s.fixed);
    walk_camera_paths(scene, walks, path, begun.hit, begun.length + 1, {}, &s.fixed);
    // The specular term covers disks seen only in perfect mirrors and through smooth glass
    // (boundary/specular/chain_shadow.h).
    path.active &= s.screen_form | (path.pdf > 0.0f);
    if (!any(path.active)) return s;
    const ScatteringPoint x = scattering_point(scene, walks, path, path.active, begun.hit);
    s.active = x.x.active;
    s.x = x.x;
    // Sample a point of the line of face and disk
    IntersectingPair& pair = s.pair;
    faces_of_line(scene, p.active, p.edge, pair.hider, pair.hider_instance, pair.row);
    pair.face = pair.instance = splat(-1);
    s.y.row = pair.row;
    s.y.kind = kind_of_rows(scene.lights, pair.row);
    const Triangle triangle = placed_triangle(scene, pair.hider, pair.hider_instance).triangle;
    pair.hider_normal = unit_normal(triangle);
    const LightRow l = gather_light(scene.lights, pair.row);
    s.u = p.u0 + (p.u1 - p.u0) * p.tau;
    const LightCut cut = facing_disk_cut(l, triangle, pair.hider_normal, x.x.position, s.u);
    s.point = cut.point;
    pair.normal = cut.normal;
    const Vec3 way = s.point - x.x.position;
    const Float r2 = dot(way, way);
    s.reach = sqrt(r2);
    s.towards = way * (1.0f / max(s.reach, 1e-30f));
    s.distance = s.lambda = splat(0.0f);
    s.active &= cut.active & (s.y.kind == splat(kDiskLight)) & (r2 > 0.0f) &
                shines_on(scene, pair.row, x.x.mesh, bounces_before(path));
    hide_beside(cut.tangent, -s.towards, s);
    // If x lies in the face's plane, the light arrives along x's horizon, which the horizon term covers
    // (boundary/terms/horizon.h).
    s.active &= (abs(dot(pair.hider_normal, s.towards)) > 1e-5f) &
                ((x.x.face != pair.hider) | (x.x.instance != pair.hider_instance));
    LightSample links = no_light_sample(scene, splat(0), s.active, pair.row, s.y.kind);
    take_links(scene.lights, s.active, pair.row, gather(scene.lights.flags, pair.row), links);
    const Int hider_mask = gather(scene.mesh_mask, mesh_of(scene, pair.hider));
    s.active &= links.casts_shadow & ((hider_mask & links.blockers) != 0);
    // Skip samples that do not move or do not count
    s.view = place_in_picture(scene, s.active, select(s.screen_form, x.x.position, begun.first), p.random);
    s.active &= s.view.active;
    Mask moves = receiver_moves(scene, motion, s.active, s.x, s.screen_form) |
                 face_point_moves(scene, motion, s.active, pair.hider, pair.hider_instance);
    if (motion.lights_requested) moves |= s.active;
    s.active &= moves;
    if (!task.score && any(s.active)) s.active &= has_adjoint(scene, s.active, s.view.sx, s.view.sy, adjoint);
    if (!any(s.active)) return s;

    // Evaluate the BSDF and the light
    const CameraSampledSurface surface(scene, x, s.active, splat(0.0f));
    const Int kinds = links.visible_to;
    const Vec3 value = surface.evaluate(s.active, s.towards, kinds) * (1.0f / max(r2, 1e-30f));
    const Vec3 light =
        l.radiance * light_factor(l, s.towards, s.reach) *
        stopped_by(scene, s.active, pair.hider, pair.hider_instance, s.point, -s.towards, kShadowRay);
    s.active &= (largest_component(value) > 0.0f) & (largest_component(light) > 0.0f);
    if (!any(s.active)) return s;
    const Vec3 start = leave_surface(x.x, s.towards) + terminator_lift(scene, x.x, x.point.normal, s.towards);
    PassingRays rays{links.blockers};
    rays.ignored = {p.edge, splat(-1)};
    const Vec3 seen = transmittance(scene, s.active, start, s.point - start, splat(0.99999f), rays);
    s.color = path.throughput * value * light * seen * (x.shader.scale * begun.weight * (p.u1 - p.u0));
    divide_slide(s);
    s.active &= ~(largest_component(s.color) == 0.0f);
    return s;
}

// Adds sweep . (dq - dy), times the color, for the requested parameters. q lies on the face and on the disk.
template <typename Mode>
EG_INLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                             const DiskSegment& s) {
    const Vec3 color = select(s.screen_form, s.color * -dot(s.x.normal, s.view.across_of), s.color);
    const Vec3 g = hider_blocks(mode, scene, motion, s, color) - s.sweep;
    const Vec3 from =
        far_end_blocks(mode, scene, motion, s.active, s.y, s.x.position, s.towards, s.reach, g, color);
    receiver_blocks(mode, scene, motion, s, from);
}

}  // namespace edgegrad::EDGEGRAD_ISA
