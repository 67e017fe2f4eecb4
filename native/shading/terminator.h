// The shadow terminator. At grazing light the flat triangles of a smooth-shaded mesh shadow each other and
// lie with their backs to light that the smooth surface would receive.
#pragma once

#include <array>

#include "scene/geometry.h"
#include "shading/receiving_normal.h"

namespace edgegrad::EDGEGRAD_ISA {

// The unit normal of a corner of a smooth face, in the world.
EG_INLINE void corner_normal(const SceneView& scene, int32_t corner, int32_t instance, float (&n)[3]) {
    const float* own = scene.normals + 3 * static_cast<int64_t>(corner);
    for (int k = 0; k < 3; ++k) n[k] = own[k];
    if (instance < 0) return;
    const Vec3 placed =
        place_normal(gather_placement(scene, splat(instance)), {splat(n[0]), splat(n[1]), splat(n[2])});
    const Vec3 unit = placed * (1.0f / sqrt(max(dot(placed, placed), 1e-30f)));
    n[0] = unit.x[0], n[1] = unit.y[0], n[2] = unit.z[0];
}

// Moves the lifted origin of a ray towards light below the plane of x's face to where the ray meets that
// plane, if that is within the face, which does not shadow itself.
EG_INLINE void pass_own_face(const SurfacePoint& x, Vec3 w, float flat, int i, Vec3& lift) {
    const auto at = [i](Vec3 v) { return std::array<float, 3>{v.x[i], v.y[i], v.z[i]}; };
    const auto n = at(x.normal), d = at(w), p = at(x.position);
    auto moved = at(lift);
    const float height = n[0] * moved[0] + n[1] * moved[1] + n[2] * moved[2];
    if (height <= 0.0f) return;
    for (int c = 0; c < 3; ++c) moved[c] += d[c] * (height / -flat);
    const std::array<float, 3> corners[3] = {at(x.triangle.p0), at(x.triangle.p1), at(x.triangle.p2)};
    int left = 0;
    for (int k = 0; k < 3; ++k) {
        float to[3], edge[3];
        for (int c = 0; c < 3; ++c) {
            to[c] = p[c] + moved[c] - corners[k][c];
            edge[c] = corners[(k + 1) % 3][c] - corners[k][c];
        }
        left += n[0] * (edge[1] * to[2] - edge[2] * to[1]) + n[1] * (edge[2] * to[0] - edge[0] * to[2]) +
                    n[2] * (edge[0] * to[1] - edge[1] * to[0]) >
                0.0f;
    }
    if (left != 0 && left != 3) return;
    lift.x[i] = moved[0], lift.y[i] = moved[1], lift.z[i] = moved[2];
}

// Offset of the origin of a shadow ray towards w, onto a smooth surface through the corners: x is projected
// onto the tangent planes at the corners (Hanika 2021, "Hacking the Shadow Terminator"). As in Cycles, the
// offset applies only where the cosines to the shading and geometric normals are small compared with the
// mesh's `terminator_offset`, with a smooth transition, and in full below the triangle's plane. The offset is
// a bias, and is 0 for meshes that do not set it.
EG_INLINE Vec3 terminator_lift(const SceneView& scene, const SurfacePoint& x, Vec3 shading, Vec3 w) {
    Vec3 lift = zero3();
    if (!scene.any_terminator) return lift;
    const Float cutoff = gather(scene.mesh_terminator, x.mesh);
    const Float facing = dot(shading, w), smooth = abs(facing), flat = dot(x.normal, w);
    const Float inverse = 1.0f / max(cutoff, 1e-6f);
    Float amount = select(smooth < cutoff, 2.0f - (flat + smooth) * inverse, 1.0f - flat * inverse);
    amount = min(max(amount, 0.0f), splat(1.0f));
    const Mask lifted = x.active & (cutoff > 0.0f) & (amount > 0.0f) & ((flat > 0.0f) | (facing > 0.0f));
    if (!any(lifted)) return lift;
    for (int i = 0; i < W; ++i) {
        const int32_t* corner = scene.corner_normal + 3 * static_cast<int64_t>(x.face[i]);
        if (!lifted[i] || corner[0] < 0 || corner[1] < 0 || corner[2] < 0) continue;
        const float b[3] = {1.0f - x.b1[i] - x.b2[i], x.b1[i], x.b2[i]};
        const Vec3 corners[3] = {x.triangle.p0, x.triangle.p1, x.triangle.p2};
        for (int k = 0; k < 3; ++k) {
            float n[3];
            corner_normal(scene, corner[k], x.instance[i], n);
            const float side = x.side[i];
            const float height = side * ((x.position.x[i] - corners[k].x[i]) * n[0] +
                                         (x.position.y[i] - corners[k].y[i]) * n[1] +
                                         (x.position.z[i] - corners[k].z[i]) * n[2]);
            if (height >= 0.0f) continue;  // already above that tangent plane
            const float up = -height * b[k] * side * amount[i];
            lift.x[i] += up * n[0];
            lift.y[i] += up * n[1];
            lift.z[i] += up * n[2];
        }
        if (flat[i] < 0.0f) pass_own_face(x, w, flat[i], i, lift);
    }
    return lift;
}

}  // namespace edgegrad::EDGEGRAD_ISA
