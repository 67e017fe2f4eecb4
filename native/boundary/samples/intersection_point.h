// The velocity of a point q on the intersection line of two planes. For any vector g perpendicular to the
// line
//   g = mu_1 n_1 + mu_2 n_2,    g . dq = mu_1 n_1 . m_1(q) + mu_2 n_2 . m_2(q),
// where n_k is the normal of plane k and m_k(q) the material velocity of its point at q (derivations, F1).
#pragma once

#include "boundary/samples/moving_points.h"
#include "boundary/samples/outline_samples.h"
#include "shading/surface_shader.h"
#include "shading/surface_transmittance.h"

namespace edgegrad::EDGEGRAD_ISA {

// Computes mu_1 and mu_2. Nearly parallel planes are excluded earlier, because their line has unbounded
// velocity.
EG_INLINE void part_normals(Vec3 g, Vec3 n1, Vec3 n2, Float& mu1, Float& mu2) {
    const Float cosine = dot(n1, n2), inverse = 1.0f / max(1.0f - cosine * cosine, 1e-7f);
    const Float one = dot(g, n1), other = dot(g, n2);
    mu1 = (one - cosine * other) * inverse;
    mu2 = (other - cosine * one) * inverse;
}

EG_INLINE Vec3 unit_normal(const Triangle& t) { return unit_vector(area_normal(t)); }

// The fraction of light along w that a face, placed by an instance, or a field absorbs at a point.
// Transmitted light is not occluded.
EG_INLINE Vec3 stopped_by(const SceneView& scene, Mask active, Int face, Int instance, Vec3 at, Vec3 w,
                          RayKind rays) {
    if (!(scene.all_flags & kHasTransparency)) return one3();
    Float b1, b2;
    const PlacedTriangle t = placed_triangle(scene, face, instance);
    place_in_face(t.triangle, at, b1, b2);
    set_places(scene, on_field(scene, active, face), face, at, b1, b2);
    const SurfacePoint i = surface_point(scene, active, face, t, b1, b2, w, instance);
    const Vec3 through = surface_transmittance(scene, i, texture_point(scene, i, -w, splat(rays)));
    return {1.0f - through.x, 1.0f - through.y, 1.0f - through.z};
}

// Adds g . m(at), times the color, for a material point of a face, or for a point of a field's surface, which
// moves along its normal.
template <typename Mode>
EG_INLINE void plane_point_blocks(Mode& mode, const SceneView& scene, const DerivativeView& requested,
                                  Mask active, Int face, Int instance, Vec3 at, Vec3 g, Vec3 color) {
    Mask moves = face_point_moves(scene, requested, active, face, instance);
    if (!any(moves)) return;
    const Mask field = on_field(scene, moves, face);
    if (any(field)) {
        mode.field(field, face, at, g, color);
        moves &= ~field;
    }
    const PlacedTriangle t = placed_triangle(scene, moves, face, instance);
    Float b1, b2;
    place_in_face(t.triangle, at, b1, b2);
    face_point_blocks(mode, scene, requested, moves, face, instance, b1, b2, g, color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
