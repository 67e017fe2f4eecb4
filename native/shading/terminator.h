// The shadow terminator. At grazing light the flat triangles of a smooth-shaded mesh shadow each other and
// lie with their backs to light that the smooth surface would receive.
#pragma once

#include "scene/geometry.h"

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

// Height above x's face, along its interpolated normal, at which a shadow ray starts: `normal` and `at` are
// the unit normals, on the side to which the ray is lifted, and the positions of the corners, relative to x,
// and b their weights. It is the height of the lowest of three planes, or that of the patch of second order
// through the normals if that is higher. A corner's plane is its tangent plane, raised until no corner lies
// above it.
EG_INLINE float terminator_height(const float (&normal)[3][3], const float (&at)[3][3], const float (&b)[3]) {
    const auto along = [&](int k, int j) {
        return normal[k][0] * at[j][0] + normal[k][1] * at[j][1] + normal[k][2] * at[j][2];
    };
    float lowest = __builtin_inff(), patch = 0.0f;
    for (int k = 0; k < 3; ++k) {
        float highest = along(k, k);
        for (int j = 0; j < 3; ++j) {
            highest = along(k, j) > highest ? along(k, j) : highest;
            if (j > k) patch += 0.5f * b[k] * b[j] * (along(j, j) - along(j, k) - along(k, j) + along(k, k));
        }
        lowest = highest < lowest ? highest : lowest;
    }
    lowest = lowest > 0.0f ? lowest : 0.0f;
    return lowest > patch ? lowest : patch;
}

// Offset of the origin of a shadow ray towards w, onto a smooth surface through the corners
// (terminator_height). As in Cycles, the offset applies only where the cosines to the shading and geometric
// normals are small compared with the mesh's `terminator_offset`, with a smooth transition, and in full below
// the triangle's plane. It leads to the side of the face that the light reaches by the shading normal: to the
// far side for light that passes through, also where the interpolated normal points into the face. The offset
// is a bias, and is 0 for meshes that do not set it.
EG_INLINE Vec3 terminator_lift(const SceneView& scene, const SurfacePoint& x, Vec3 shading, Vec3 w) {
    Vec3 lift = zero3();
    if (!scene.any_terminator) return lift;
    const Float cutoff = gather(scene.mesh_terminator, x.mesh);
    const Float facing = dot(shading, w), smooth = abs(facing);
    const Float lit_side = select(facing < 0.0f, splat(-1.0f), splat(1.0f));
    const Float flat = dot(x.normal, w) * lit_side;
    const Float inverse = 1.0f / max(cutoff, 1e-6f);
    Float amount = select(smooth < cutoff, 2.0f - (flat + smooth) * inverse, 1.0f - flat * inverse);
    amount = min(max(amount, 0.0f), splat(1.0f));
    const Mask lifted = x.active & (cutoff > 0.0f) & (amount > 0.0f);
    if (!any(lifted)) return lift;
    for (int i = 0; i < W; ++i) {
        const int32_t* corner = scene.corner_normal + 3 * static_cast<int64_t>(x.face[i]);
        if (!lifted[i] || corner[0] < 0 || corner[1] < 0 || corner[2] < 0) continue;
        const float b[3] = {1.0f - x.b1[i] - x.b2[i], x.b1[i], x.b2[i]};
        const Vec3 corners[3] = {x.triangle.p0, x.triangle.p1, x.triangle.p2};
        float normal[3][3], at[3][3], up[3] = {};
        for (int k = 0; k < 3; ++k) {
            corner_normal(scene, corner[k], x.instance[i], normal[k]);
            for (int c = 0; c < 3; ++c) up[c] += b[k] * normal[k][c];
            at[k][0] = corners[k].x[i] - x.position.x[i];
            at[k][1] = corners[k].y[i] - x.position.y[i];
            at[k][2] = corners[k].z[i] - x.position.z[i];
        }
        const float above = up[0] * x.normal.x[i] + up[1] * x.normal.y[i] + up[2] * x.normal.z[i];
        const float sign = above * lit_side[i] > 0.0f ? 1.0f : -1.0f;
        for (auto& one : normal)
            for (float& c : one) c *= sign;
        const float height = sign * terminator_height(normal, at, b) * amount[i];
        lift.x[i] = height * up[0], lift.y[i] = height * up[1], lift.z[i] = height * up[2];
    }
    return lift;
}

}  // namespace edgegrad::EDGEGRAD_ISA
