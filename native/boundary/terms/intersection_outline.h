// The outline, in the picture, of lights of the light table where a mesh passes through them (derivations,
// F2).
//
// The camera sees the light on the side of the line where the light is in front of the face. The light
// occludes nothing, so the jump is its own radiance L. With q(u) a point of the line, t = dq/du, D the
// direction of the camera's ray through q, kappa the picture's area per area perpendicular to D, and c the
// velocity of that ray, as in boundary/terms/light_outline.h,
//   dI = int du  L kappa N . (dq - c),    N = D x t, on the side where the light is occluded,
//   N . dq = mu_1 n_1 . m_1(q) + mu_2 n_2 . m_2(q)     (boundary/samples/intersection_point.h),
// where n_1 and m_1 belong to the face, and n_2 and m_2 to the light. u is uniform on the sampled segment.
#pragma once

#include "boundary/samples/intersection_point.h"
#include "boundary/samples/light_cut.h"
#include "boundary/terms/light_outline.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

struct IntersectionOutline : OutlineSample {
    Int face, instance;  // the face, and the instance that places it
    Vec3 by_face;        // mu_1 n_1
    Vec3 by_light;       // mu_2 n_2
};

EG_OUTLINE IntersectionOutline sample_intersection_outline(const SceneView& scene, const BoundaryTask& task,
                                                           int64_t at, SegmentCursor& cursor,
                                                           const DerivativeView&, const float*) {
    IntersectionOutline s;
    const SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    // Sample a point of the line on the light
    s.active = p.active;
    s.color = zero3();
    faces_of_line(scene, s.active, p.edge, s.face, s.instance, s.row);
    s.kind = kind_of_rows(scene.lights, s.row);
    const LightRow l = gather_light(scene.lights, s.row);
    const PlacedTriangle face = placed_triangle(scene, s.face, s.instance);
    const Vec3 face_normal = unit_normal(face.triangle);
    const LensPoint lens = lens_of(scene.camera, p.random);
    const Float u = p.u0 + (p.u1 - p.u0) * p.tau;
    LightCut cut = light_cut(l, s.kind, p.a + p.t * u, p.t, face_normal);
    const Mask disk = s.active & (s.kind == splat(kDiskLight));
    if (any(disk)) {
        const Vec3 origin = project(scene.camera, l.position, lens).origin;
        const LightCut facing = facing_disk_cut(l, face.triangle, face_normal, origin, u);
        s.active &= ~disk | facing.active;
        cut.point = select(disk, facing.point, cut.point);
        cut.tangent = select(disk, facing.tangent, cut.tangent);
        cut.normal = select(disk, facing.normal, cut.normal);
    }
    s.point = cut.point;
    s.view = project(scene.camera, s.point, lens);
    // Test whether the camera can see the light there
    s.active &= s.view.active & in_reach(scene.camera, s.view.sx, s.view.sy) &
                (s.view.distance > s.view.near) & (s.view.distance < s.view.far);
    const Vec3 d = s.view.across_of;
    // The camera sees a sphere's outside, or its inside from within.
    const Vec3 way = s.view.origin - l.position;
    const Mask within = (s.kind == splat(kSphereLight)) & (dot(way, way) <= l.radius * l.radius);
    const Float face_along = dot(face_normal, d), light_along = dot(cut.normal, d);
    s.active &= (face_along != 0.0f) & ((light_along < 0.0f) | (within & (light_along > 0.0f)));
    if (!any(s.active)) return s;
    // The face is in front on the side where its depth decreases faster.
    s.normal = cross(d, cut.tangent);
    const Float face_falls = dot(face_normal, s.normal) / select(s.active, face_along, 1.0f);
    const Float light_falls = dot(cut.normal, s.normal) / select(s.active, light_along, 1.0f);
    s.normal = select(face_falls < light_falls, -s.normal, s.normal);
    s.weight = s.view.area * ((p.u1 - p.u0) * task.scale / p.density);
    Float mu_face, mu_light;
    part_normals(s.normal, face_normal, cut.normal, mu_face, mu_light);
    s.by_face = face_normal * mu_face, s.by_light = cut.normal * mu_light;

    // Evaluate the transmittance of surfaces in front.
    const Vec3 start = s.view.origin + s.view.direction * s.view.distance;
    PassingRays rays{splat(1 << kCameraRay), kCameraRay, task.limits.transparent};
    rays.ignored = {p.edge, splat(-1)};
    const Vec3 through = transmittance(scene, s.active, start, s.view.origin - start,
                                       1.0f - s.view.near / max(s.view.distance, 1e-30f), rays);
    s.color = l.radiance * light_factor(l, s.view.direction, s.view.distance) * through *
              stopped_by(scene, s.active, s.face, s.instance, s.point, s.view.direction, kCameraRay);
    s.active &= largest_component(s.color) > 0.0f;
    return s;
}

// Adds weight N . (dq - c), times the color, for the requested parameters.
template <typename Mode>
EG_INLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& requested,
                             const IntersectionOutline& s) {
    plane_point_blocks(mode, scene, requested, s.active, s.face, s.instance, s.point, s.by_face * s.weight,
                       s.color);
    outline_blocks(mode, scene, requested, s, s.by_light * s.weight);
}

}  // namespace edgegrad::EDGEGRAD_ISA
