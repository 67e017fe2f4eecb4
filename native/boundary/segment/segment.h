// A boundary segment: the segment between two vertices x and y of a path that touches an edge at e. One
// formula gives the derivative of the light along it, for every segment behind the camera's (derivations,
// formula S):
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (de - lambda dx - (1 - lambda) dy),
// where w is the unit direction of light from y through e to x and lambda = |e - y|/|x - y|. If y is
// infinitely far, in the direction -w, then lambda = 1 and the last part becomes |x - e| dw.
//
// Curves on distance fields take the place of edges where a segment touches a field. e then moves along the
// field's normal n, and n takes the place of t x w (boundary/terms/field_shadow.h).
//
// The motion of the ends:
// - If the camera sees x, x is in screen form: the point where its pixel's ray meets the moving surface. With
//   c the velocity of that ray, D its direction and m(x) the surface's velocity, dx = c + D n . (m - c)/(n .
//   D). A later vertex is in material form: it moves with its surface, dx = m(x). Near contact both forms are
//   blended along the ray from the vertex before it (boundary/segment/fixed_direction_chain.h).
// - y moves with its surface or its light, or turns with the environment. Light of a fixed direction moves
//   with x: lambda = 1.
#pragma once

#include "boundary/samples/moving_points.h"
#include "boundary/samples/segment_sampling.h"
#include "boundary/segment/fixed_direction_chain.h"
#include "boundary/segment/light_motion.h"
#include "path/camera_projection.h"
#include "reparameterisation/camera_blocks.h"
#include "shading/lights/environment.h"
#include "shading/lights/fixed_direction_light.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// What the far end of a segment moves with. Lanes of neither kind are static.
struct FarEnd {
    Int face, instance;  // a surface, at (b1, b2); face -1: none
    Float b1, b2;
    Int row, kind;     // a row of the light table and its LightKind; row -1: none
    Mask environment;  // the image of the environment
};

EG_INLINE FarEnd still_far_end() {
    return {splat(-1), splat(-1), splat(0.0f), splat(0.0f), splat(-1), splat(0), splat(0)};
}

EG_INLINE Mask is_distant(const FarEnd& y) { return y.environment | (y.kind >= splat(kDirectionLight)); }

struct BoundarySegment {
    Mask active;
    Int edge, instance;  // the edge and its instance, or a curve on a field (SceneView::surface_of_line)
    Float u;
    Vec3 point;      // e
    Vec3 towards;    // -w: unit, from e to y
    Vec3 sweep;      // sigma (t x w)
    Float reach;     // |x - e|
    Float distance;  // |e - y|, infinite for distant lights and the environment
    Float lambda;
    SurfacePoint x;    // its normal on the side of the viewer
    Mask screen_form;  // the camera sees x, as in `view`; else x moves with its surface
    Projection view;
    FixedDirectionChain fixed;  // near contact
    FarEnd y;
    // The integrand without sweep and velocities. In screen form it is divided by |n . D|, which cancels the
    // divisor in dx.
    Vec3 color;
};

// Where rays that pass a curve start, in front of it and behind it, at the distance `gap` from e. An edge has
// no gap: rays ignore its faces.
struct CurveExit {
    Vec3 before, behind;  // towards y, and towards x
    Float gap;
    Ignored ignored;
};
EG_INLINE CurveExit exit_of_edge(const BoundarySegment& s) {
    return {s.point, s.point, splat(0.0f), {s.edge, s.instance}};
}

// Starts a segment at the sample's point of a line, without a place in the picture.
EG_INLINE void begin_segment(const SegmentSample& p, BoundarySegment& s) {
    s.active = p.active;
    s.edge = p.edge;
    s.instance = p.instance;
    s.u = p.u0 + (p.u1 - p.u0) * p.tau;
    s.point = p.a + p.t * s.u;
    s.y = still_far_end();
    s.color = zero3();
    s.view.sx = s.view.sy = splat(kNowhere);
}

// Sets lambda, once x and y are known.
EG_INLINE void divide_segment(BoundarySegment& s) {
    const Mask finite = s.distance < __builtin_inff();
    s.lambda = select(finite, s.distance / max(s.distance + s.reach, 1e-30f), splat(1.0f));
}

// The factor of a light's decay over the whole segment.
EG_INLINE Float decay_along(const SceneView& scene, const BoundarySegment& s) {
    const Mask on_row = s.active & (s.y.row >= 0);
    if (!any(on_row)) return splat(1.0f);
    const LightRow l = gather_light(scene.lights, select(on_row, s.y.row, splat(0)));
    return select(on_row, distance_factor(l, s.reach + s.distance), splat(1.0f));
}

// If the light of y has a fixed direction (shading/lights/fixed_direction_light.h), the segment moves with x
// alone.
EG_INLINE void fix_light_direction(const SceneView& scene, BoundarySegment& s) {
    const Mask fixed = holds_direction(scene, s.active, s.y.face, s.x.material);
    s.y.face = select(fixed, splat(-1), s.y.face);
    s.lambda = select(fixed, splat(1.0f), s.lambda);
}

// The blending weight b of y (scene/contact.h), if `length` surfaces lie between the camera and x.
EG_INLINE Float fixed_direction_weight(const SceneView& scene, Mask active, Int length, const SurfacePoint& x,
                                       const FarEnd& y) {
    const Mask fixed = active & (length < scene.fixed_direction_surfaces) & (y.face >= 0);
    return contact_with_face(scene, fixed, x, y.face, y.instance, y.b1, y.b2).share;
}

// Blends the segment's motion towards a fixed direction if y is close to x (scene/contact.h). This applies to
// the first few surfaces of a path.
EG_INLINE void blend_near_contact(const SceneView& scene, Int length, BoundarySegment& s) {
    if (!scene.mesh_contact) return;
    s.lambda = s.lambda + (1.0f - s.lambda) * fixed_direction_weight(scene, s.active, length, s.x, s.y);
}

// Whether x may move: with its surface, with the camera that sees it, or with the vertex before it near
// contact.
EG_INLINE Mask receiver_moves(const SceneView& scene, const DerivativeView& motion, Mask active,
                              const SurfacePoint& x, Mask screen_form) {
    Mask moves = face_point_moves(scene, motion, active, x.face, x.instance);
    if (rays_move(motion)) moves |= active & screen_form;
    if (scene.mesh_contact)
        moves |= active & ~screen_form &
                 ((gather(scene.mesh_contact, select(active, x.mesh, splat(0))) & kContactTo) != 0);
    return moves;
}

// Whether any part of the segment may move.
EG_INLINE Mask segment_moves(const SceneView& scene, const DerivativeView& motion, const BoundarySegment& s) {
    Mask moves = edge_point_moves(scene, motion, s.active, s.edge, s.instance) |
                 receiver_moves(scene, motion, s.active, s.x, s.screen_form) |
                 face_point_moves(scene, motion, s.active & (s.y.face >= 0), s.y.face, s.y.instance);
    if (motion.lights_requested) moves |= s.active & (s.y.row >= 0);
    if (motion.rotation_requested) moves |= s.active & s.y.environment;
    return moves;
}

// Adds the velocity of a y that is not on a mesh, at `distance` from x along `towards`. g is the adjoint of
// y, or of the direction to y for distant lights. Returns the adjoint of x, on which some lights depend.
template <typename Mode>
EG_INLINE Vec3 far_end_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion, Mask active,
                              const FarEnd& y, Vec3 x, Vec3 towards, Float distance, Vec3 g, Vec3 color) {
    Vec3 from = zero3();
    const Mask on_row = active & (y.row >= 0);
    if (any(on_row)) {
        Float row[kLightParams];
        const Int light = select(on_row, y.row, splat(0));
        const Float way = select(is_distant(y), splat(1.0f), distance);
        from = select(on_row, light_motion_row(scene.lights, light, y.kind, x, towards * way, g, row), from);
        if (motion.lights_requested) mode.light(on_row, light, row, color);
    }
    const Mask environment = active & y.environment;
    if (motion.rotation_requested && any(environment)) {
        const Vec3 d = rotated(scene.environment_rotation, towards);
        const Float row[9] = {d.x * g.x, d.x * g.y, d.x * g.z, d.y * g.x, d.y * g.y,
                              d.y * g.z, d.z * g.x, d.z * g.y, d.z * g.z};
        mode.rotation(environment, row, color);
    }
    return from;
}

// Prepares the color of samples that start at the camera: in screen form the slide of x is divided by |n .
// D|.
EG_INLINE void divide_slide(BoundarySegment& s) {
    const Float facing = max(-dot(s.x.normal, s.view.across_of), 1e-20f);
    s.color = select(s.screen_form, s.color * (1.0f / facing), s.color);
}

// Adds the velocity of x, with g its adjoint. For a slide, n (g . D)/(n . D) is the surface's part of g, and
// the rest is the ray's. Cancelling n . D with the |n . D| of the color keeps both bounded at grazing views.
template <typename Mode>
EG_INLINE void receiver_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                               const BoundarySegment& s, Vec3 g) {
    const Float nd = dot(s.x.normal, s.view.across_of);  // negative
    const Vec3 along = s.x.normal * -dot(g, s.view.across_of);
    Vec3 to_face = select(s.screen_form, along, g);
    if (scene.mesh_contact && any(s.active & (s.fixed.length > 0)))
        to_face =
            fixed_direction_blocks(mode, scene, motion, s.active, s.fixed, s.x, s.view, g, to_face, s.color);
    surface_point_blocks(mode, scene, motion, s.active, s.x.face, s.x.instance, s.x.b1, s.x.b2, s.x.position,
                         to_face, s.color);
    const Mask seen = s.active & s.screen_form;
    if (any(seen)) camera_blocks(mode, scene, motion, seen, s.view, g * -nd - along, s.color);
}

// Adds the velocities of edge, x and y, for the requested parameters.
template <typename Mode>
EG_OUTLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                              const BoundarySegment& s) {
    const Float nd = dot(s.x.normal, s.view.across_of);  // negative
    const Vec3 color = select(s.screen_form, s.color * -nd, s.color);
    edge_point_blocks(mode, scene, motion, s.active, s.edge, s.instance, s.u, s.sweep, color);
    if (motion.fields.any()) {
        const Int face = edge_face(scene, s.edge);
        mode.field(on_field(scene, s.active, face), face, s.point, s.sweep, color);
    }
    const Mask on_face = s.active & (s.y.face >= 0);
    if (any(on_face))
        surface_point_blocks(mode, scene, motion, on_face, s.y.face, s.y.instance, s.y.b1, s.y.b2,
                             s.point + s.towards * select(on_face, s.distance, splat(0.0f)),
                             s.sweep * (s.lambda - 1.0f), color);
    // For distant lights the direction to them moves: dw = -d(-w).
    const Vec3 by_y = s.sweep * select(is_distant(s.y), -s.reach, s.lambda - 1.0f);
    const Vec3 from = far_end_blocks(mode, scene, motion, s.active, s.y, s.x.position, s.towards,
                                     s.reach + s.distance, by_y, color);
    receiver_blocks(mode, scene, motion, s, from - s.sweep * s.lambda);
}

// The swept area per unit of color, if the edge moves across the segment by one unit.
EG_INLINE Float sweep_of(const BoundarySegment& s) {
    const Float facing = select(s.screen_form, -dot(s.x.normal, s.view.across_of), splat(1.0f));
    return facing * sqrt(dot(s.sweep, s.sweep));
}

// The change of the picture if the edge moves across the segment by one unit.
EG_INLINE Float size_of(const BoundarySegment& s) { return size_of(s.color) * sweep_of(s); }

// Drops samples of infinite size. Writes the sizes of a first pass, by which the second pass is distributed
// (boundary/samples/sample_plan.h).
EG_INLINE void weigh(const BoundaryTask& task, int64_t at, BoundarySegment& s) {
    const Float size = any(s.active) ? size_of(s) : splat(0.0f);
    s.active = weigh_samples(task, at, s.active, s.edge, s.instance, size);
}

}  // namespace edgegrad::EDGEGRAD_ISA
