// Bump mapping: the normal bent by the slopes of a height, and the shifted points at which the height is
// taken.
#pragma once

#include "scene/geometry.h"
#include "texture/normal_map.h"

namespace edgegrad::EDGEGRAD_ISA {

// A unit vector orthogonal to the normal n. Cycles takes the heights of bump maps along the same vector.
EG_INLINE Vec3 bump_tangent(Vec3 n) {
    const Mask diagonal = (n.x == n.y) & (n.x == n.z);
    const Vec3 a = {n.z - n.y, n.x - n.z, n.y - n.x};     // (1, 1, 1) x n
    const Vec3 b = {n.z - n.y, n.x + n.z, -(n.y + n.x)};  // (-1, 1, 1) x n
    return normalized_or(select(diagonal, b, a), zero3());
}

// The normal n, bent by a height with the slopes x and y along the surface's tangents (Mikkelsen 2010, "Bump
// Mapping Unparametrized Surfaces on the GPU"), and mixed with n.
EG_INLINE Vec3 bumped_normal(Vec3 surface, Vec3 n, Float x, Float y, Float strength) {
    const Vec3 a = bump_tangent(surface), b = cross(surface, a);
    const Float cosine = dot(n, surface);
    const Vec3 gradient = cross(b, n) * x + cross(n, a) * y;
    const Vec3 bent =
        normalized_or(n * abs(cosine) - gradient * select(cosine < 0.0f, splat(-1.0f), 1.0f), n);
    return normalized_or(bent * strength + n * (1.0f - strength), n);
}

// Barycentrics of the point at a distance `shift`, in the plane of the face, from the texture point.
// `mirrored`: on back sides, at the opposite distance. Cycles has it so for attributes, but not for
// positions.
EG_INLINE Vec3 shifted_barycentrics(const SceneView& scene, Int face, const TexturePoint& point, Vec3 shift,
                                    bool mirrored) {
    if (mirrored) shift = select(point.backside, -shift, shift);
    Triangle t = gather_triangle(scene, face);
    place_triangle(scene, point.instance, t);
    const Vec3 e1 = t.p1 - t.p0, e2 = t.p2 - t.p0, m = cross(e1, e2);
    const Float length = sqrt(dot(m, m));
    const Float inverse = 1.0f / select(length > 0.0f, length, 1.0f);
    const Vec3 n = m * inverse;
    // The gradients of the barycentrics are e2 x n / |m| and n x e1 / |m|.
    return {point.b1 + dot(cross(e2, n), shift) * inverse, point.b2 + dot(cross(n, e1), shift) * inverse,
            splat(0.0f)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
