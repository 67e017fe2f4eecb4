// A boundary segment: the line between two vertices x and y of a path that touches an edge at e. How the
// light along it changes as all of them move is one formula for every segment behind the camera's (S of the
// derivations):
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (de - lambda dx - (1 - lambda) dy),
// w the unit direction of light from y through e to x, lambda = |e - y|/|x - y|. Where y is infinitely far,
// in the direction -w: lambda = 1, and the last part is |x - e| dw.
//
// How the ends move:
// - x, if the camera sees it, is where its pixel's ray meets its moving surface: with c the velocity of that
//   ray, D its direction and m(x) the velocity of the surface, dx = c + D n . (m - c)/(n . D). A vertex that
//   is seen by way of other surfaces rides on its own, dx = m(x), or near the camera's surface slides along
//   the ray from there by a share.
// - y rides on its surface, on a light, or turns with the environment; or it is where the direction from x
//   leads, lambda = 1.
#pragma once

#include "boundary/samples/moving_points.h"
#include "boundary/samples/segment_sampling.h"
#include "boundary/segment/fixed_direction_chain.h"
#include "boundary/segment/light_motion.h"
#include "path/camera_projection.h"
#include "shading/lights/environment.h"
#include "shading/lights/fixed_direction_light.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// What the far end of a segment rides on; lanes of no kind stand still.
struct FarEnd {
    Int face, instance;  // a surface at (b1, b2); face -1: none
    Float b1, b2;
    Int row, kind;  // a row of the light table, and its LightKind; row -1: none
    Mask sky;       // the environment's image
};

EG_INLINE FarEnd still_far_end() {
    return {splat(-1), splat(-1), splat(0.0f), splat(0.0f), splat(-1), splat(0), splat(0)};
}

EG_INLINE Mask is_distant(const FarEnd& y) {
    return y.sky | (y.kind >= splat(static_cast<int>(kDirectionLight)));
}

struct BoundarySegment {
    Mask active;
    Int edge, instance;  // the edge, and which of its copies
    Float u;
    Vec3 point;      // e
    Vec3 towards;    // -w: unit, from e to y
    Vec3 sweep;      // sigma (t x w)
    Float reach;     // |x - e|
    Float distance;  // |e - y|, infinite of distant lights and the environment
    Float lambda;
    SurfacePoint x;  // its normal on the side from which it is seen
    Mask slides;     // x is seen by the camera, as `view` says; else it rides on its surface
    Projection view;
    FixedDirectionChain held;  // where light is held
    FarEnd y;
    // Everything but sweep, velocities and, where x slides, |n . D|: the slide is divided by it.
    Vec3 color;
};

// Sets lambda, once x and y are known.
EG_INLINE void divide_segment(BoundarySegment& s) {
    const Mask finite = s.distance < __builtin_inff();
    s.lambda = select(finite, s.distance / max(s.distance + s.reach, 1e-30f), splat(1.0f));
}

// Where y gives light whose direction is held (shading/lights/fixed_direction_light.h), the segment moves
// with x alone.
EG_INLINE void hold_far_end(const SceneView& scene, BoundarySegment& s) {
    const Mask held = holds_direction(scene, s.active, s.y.face, s.x.material);
    s.y.face = select(held, splat(-1), s.y.face);
    s.lambda = select(held, splat(1.0f), s.lambda);
}

// The share of y's motion that x takes along, after `length` surfaces that the camera sees it by.
EG_INLINE Float held_share(const SceneView& scene, Mask active, Int length, const SurfacePoint& x,
                           const FarEnd& y) {
    const Mask held = active & (length < scene.fixed_direction_surfaces) & (y.face >= 0);
    return contact_with_face(scene, held, x, y.face, y.instance, y.b1, y.b2).share;
}

// Where y is near x, the segment moves with x by a share (scene/contact.h), for the first surfaces of paths.
EG_INLINE void hold_contact(const SceneView& scene, Int length, BoundarySegment& s) {
    if (!scene.mesh_contact) return;
    s.lambda = s.lambda + (1.0f - s.lambda) * held_share(scene, s.active, length, s.x, s.y);
}

// Whether x may move: on its surface, with the camera that sees it, or with a surface that does.
EG_INLINE Mask lit_end_moves(const SceneView& scene, const DerivativeView& motion, Mask active,
                             const SurfacePoint& x, Mask slides) {
    Mask moves = face_point_moves(scene, motion, active, x.face, x.instance);
    if (motion.camera_requested) moves |= active & slides;
    if (scene.mesh_contact)
        moves |= active & ~slides &
                 ((gather(scene.mesh_contact, select(active, x.mesh, splat(0))) & kContactTo) != 0);
    return moves;
}

// Whether anything of the segment may move.
EG_INLINE Mask segment_moves(const SceneView& scene, const DerivativeView& motion, const BoundarySegment& s) {
    Mask moves = edge_point_moves(scene, motion, s.active, s.edge, s.instance) |
                 lit_end_moves(scene, motion, s.active, s.x, s.slides) |
                 face_point_moves(scene, motion, s.active & (s.y.face >= 0), s.y.face, s.y.instance);
    if (motion.lights_requested) moves |= s.active & (s.y.row >= 0);
    if (motion.rotation_requested) moves |= s.active & s.y.sky;
    return moves;
}

// The velocity of a y that isn't on a surface, at `distance` from the point x along `towards`: g is the
// adjoint of that of y, of distant ones that of the direction to them. What is returned is the adjoint of x,
// on which some lights depend.
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
    const Mask sky = active & y.sky;
    if (motion.rotation_requested && any(sky)) {
        const Vec3 d = rotated(scene.environment_rotation, towards);
        const Float row[9] = {d.x * g.x, d.x * g.y, d.x * g.z, d.y * g.x, d.y * g.y,
                              d.y * g.z, d.z * g.x, d.z * g.y, d.z * g.z};
        mode.rotation(sky, row, color);
    }
    return from;
}

// The velocity of x, whose adjoint is g. Of a slide, n (g . D)/(n . D) goes to the surface, its rest to the
// ray: with the |n . D| of the color cancelled both are bounded at grazing views.
template <typename Mode>
EG_INLINE void lit_end_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                              const BoundarySegment& s, Vec3 g) {
    const Float nd = dot(s.x.normal, s.view.across_of);  // negative
    const Vec3 along = s.x.normal * -dot(g, s.view.across_of);
    Vec3 to_face = select(s.slides, along, g);
    if (scene.mesh_contact && any(s.active & (s.held.length > 0)))
        to_face =
            fixed_direction_blocks(mode, scene, motion, s.active, s.held, s.x, s.view, g, to_face, s.color);
    face_point_blocks(mode, scene, motion, s.active, s.x.face, s.x.instance, s.x.b1, s.x.b2, to_face,
                      s.color);
    const Mask seen = s.active & s.slides;
    if (motion.camera_requested && any(seen)) {
        Float row[kCameraFloats];
        ray_velocity_row(scene.camera, s.view, g * -nd - along, row);
        mode.camera(seen, row, s.color);
    }
}

// The velocities of all ends, for what `asked` names.
template <typename Mode>
EG_INLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                             const BoundarySegment& s) {
    const Float nd = dot(s.x.normal, s.view.across_of);  // negative
    const Vec3 color = select(s.slides, s.color * -nd, s.color);
    edge_point_blocks(mode, scene, motion, s.active, s.edge, s.instance, s.u, s.sweep, color);
    const Mask on_face = s.active & (s.y.face >= 0);
    if (any(on_face))
        face_point_blocks(mode, scene, motion, on_face, s.y.face, s.y.instance, s.y.b1, s.y.b2,
                          s.sweep * (s.lambda - 1.0f), color);
    // Of distant ones the direction to them moves: dw = -d(-w).
    const Vec3 by_y = s.sweep * select(is_distant(s.y), -s.reach, s.lambda - 1.0f);
    const Vec3 from = far_end_blocks(mode, scene, motion, s.active, s.y, s.x.position, s.towards,
                                     s.reach + s.distance, by_y, color);
    lit_end_blocks(mode, scene, motion, s, from - s.sweep * s.lambda);
}

// What a motion of the edge across the segment sweeps, per unit and color.
EG_INLINE Float sweep_of(const BoundarySegment& s) {
    const Float facing = select(s.slides, -dot(s.x.normal, s.view.across_of), splat(1.0f));
    return facing * sqrt(dot(s.sweep, s.sweep));
}

// What a motion of the edge across the segment changes, per unit.
EG_INLINE Float size_of(const BoundarySegment& s) { return size_of(s.color) * sweep_of(s); }

// Leaves out samples without a finite size, and writes the sizes of those of a first pass, by which the
// samples of a second are distributed (boundary/samples/sample_plan.h).
EG_INLINE void weigh(const BoundaryTask& task, int64_t at, BoundarySegment& s) {
    Float size = splat(0.0f);
    if (any(s.active)) {
        size = size_of(s);
        s.active = keep_finite(task, at, s.active, s.edge, s.instance, size);
    }
    if (!task.score) return;
    for (int i = 0; i < W && at + i < task.count; ++i)
        task.score[task.first + at + i] = s.active[i] ? size[i] : 0.0f;
}

}  // namespace edgegrad::EDGEGRAD_ISA
