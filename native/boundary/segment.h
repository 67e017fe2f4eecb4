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
//   is seen by way of other surfaces rides on its own, dx = m(x).
// - y rides on its surface, on a light, or turns with the environment.
#pragma once

#include "boundary/moving_points.h"
#include "boundary/pieces.h"
#include "path/camera_projection.h"

namespace edgegrad::EDGEGRAD_ISA {

// What the far end of a segment rides on; lanes of neither kind are infinitely far, or stand still.
struct FarEnd {
    Int face, instance;  // a surface at (b1, b2); face -1: none
    Float b1, b2;
};

EG_INLINE FarEnd still_far_end() { return {splat(-1), splat(-1), splat(0.0f), splat(0.0f)}; }

struct BoundarySegment {
    Mask active;
    Int edge, instance;  // the edge, and which of its copies
    Float u;
    Vec3 point;  // e
    Vec3 sweep;  // sigma (t x w)
    Float lambda;
    SurfacePoint x;  // its normal on the side from which it is seen
    Mask slides;     // x is seen by the camera, as `view` says; else it rides on its surface
    Projection view;
    FarEnd y;
    // Everything but sweep, velocities and, where x slides, |n . D|: the slide is divided by it.
    Vec3 color;
};

// Whether anything of the segment may move.
EG_INLINE Mask segment_moves(const SceneView& scene, const DerivativeView& asked, const BoundarySegment& s) {
    Mask moves = edge_point_moves(scene, asked, s.active, s.edge, s.instance) |
                 face_point_moves(scene, asked, s.active, s.x.face, s.x.instance) |
                 face_point_moves(scene, asked, s.active & (s.y.face >= 0), s.y.face, s.y.instance);
    if (asked.want_camera) moves |= s.active & s.slides;
    return moves;
}

// What a motion of the edge across the segment counts for.
EG_INLINE Float size_of(const BoundarySegment& s) { return size_of(s.color) * sqrt(dot(s.sweep, s.sweep)); }

// The velocities of all ends, for what `asked` names.
template <typename Mode>
EG_INLINE void segment_blocks(Mode& mode, const SceneView& scene, const DerivativeView& asked,
                              const BoundarySegment& s) {
    const Float nd = dot(s.x.normal, s.view.across_of);  // negative
    const Vec3 color = select(s.slides, s.color * -nd, s.color);
    edge_point_blocks(mode, scene, asked, s.active, s.edge, s.instance, s.u, s.sweep, color);
    const Mask on_face = s.active & (s.y.face >= 0);
    if (any(on_face))
        face_point_blocks(mode, scene, asked, on_face, s.y.face, s.y.instance, s.y.b1, s.y.b2,
                          s.sweep * (s.lambda - 1.0f), color);
    // The adjoint of dx. Of a slide, n (g . D)/(n . D) goes to the surface, its rest to the ray: with the
    // |n . D| of the color cancelled both are bounded at grazing views.
    const Vec3 g = -s.sweep * s.lambda;
    const Vec3 along = s.x.normal * -dot(g, s.view.across_of);
    face_point_blocks(mode, scene, asked, s.active, s.x.face, s.x.instance, s.x.b1, s.x.b2,
                      select(s.slides, along, g), s.color);
    const Mask seen = s.active & s.slides;
    if (asked.want_camera && any(seen)) {
        Float row[kCameraFloats];
        ray_velocity_row(scene.camera, s.view, g * -nd - along, row);
        mode.camera(seen, row, s.color);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
