// Segments that touch distance fields: by the outline of a field as a light without size sees it, or by
// tangents of its surface.
//
// The lines that touch a smooth surface have the measure dA dw = kappa_n dA dpsi, where the surface has the
// area A, psi is the angle of the line in the tangent plane, and kappa_n = w . H w / |g| the normal curvature
// along it (H = grad g; derivations, R). Only lines with kappa_n > 0 stay outside beside the point.
#pragma once

#include "boundary/samples/field_patches.h"
#include "boundary/samples/intersection_point.h"
#include "boundary/segment/segment.h"
#include "boundary/segment/silhouette.h"

namespace edgegrad::EDGEGRAD_ISA {

// Rays that pass the point e of a field start where they no longer touch the surface, slightly above it.
EG_INLINE CurveExit exit_of_field(const BoundarySegment& s, Vec3 normal, Float contact) {
    const Vec3 above = s.point + normal * (4e-6f * largest_component(s.point));
    return {above + s.towards * contact, above - s.towards * contact, contact, ignore_nothing()};
}

// Whether rays that have a bit of `mask` meet the field of each sample.
EG_INLINE Mask meets_field(const SceneView& scene, const BoundarySegment& s, Int mask) {
    const Int mesh = mesh_of(scene, field_of_line(scene, s.active, s.edge));
    return (gather(scene.mesh_mask, mesh) & mask) != 0;
}

// The part of light along w that a field stops beside a point at which w touches it. A line a little below
// that passes the surface twice.
EG_INLINE Vec3 stopped_by_field(const SceneView& scene, Mask active, Int face, Vec3 at, Vec3 normal, Vec3 w,
                                RayKind rays) {
    const Vec3 one = {splat(1.0f), splat(1.0f), splat(1.0f)};
    if (!(scene.all_flags & kHasTransparency)) return one;
    const Int known = select(active, face, splat(scene.first_field_face));
    const Vec3 in = stopped_by(scene, active, known, splat(-1), at, onto_surface(w, normal), rays),
               out = stopped_by(scene, active, known, splat(-1), at, onto_surface(w, normal, true), rays);
    return one - (one - in) * (one - out);
}

// A point of the surface with a line that touches it there.
struct TouchingLine {
    PatchSample at;
    CurveExit exit;
    Float measure;  // one over the density of the point and the line, without that of the angle
};

// Samples a point of a field's surface. `v` completes the sample's place on its patch.
EG_INLINE SegmentSample begin_on_field(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                       SegmentCursor& cursor, TouchingLine& line, Float& angle,
                                       BoundarySegment& s) {
    SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    begin_segment(p, s);
    Float v;
    const float cells = cell_numbers(task, p, v, angle);
    place_on_patches(scene, s.active, s.edge, s.u, v, line.at);
    s.point = line.at.position;
    line.measure = line.at.area * (p.u1 - p.u0) / (p.density * splat(cells));
    return p;
}

// Sets the direction towards y of the lines, and what follows from it: their measure, the sweep and where
// rays start.
EG_INLINE void touch(const SceneView& scene, Vec3 towards, TouchingLine& line, BoundarySegment& s) {
    s.towards = towards;
    Float curvature, contact;
    find_tangent_rays(scene, s.active, s.edge, line.at, towards, curvature, contact);
    line.measure = line.measure * curvature;
    s.sweep = -line.at.normal;
    line.exit = exit_of_field(s, line.at.normal, contact);
}

// The direction of a tangent at an angle, a fraction of a turn.
EG_INLINE Vec3 tangent_at(Vec3 normal, Float turn) {
    Vec3 a, b;
    basis(normal, a, b);
    Float sine, cosine;
    sincos_turn(min(turn, splat(0.99999994f)), sine, cosine);
    return a * cosine + b * sine;
}

}  // namespace edgegrad::EDGEGRAD_ISA
