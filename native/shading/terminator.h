// The shadow terminator: where light grazes a smooth-shaded surface, its flat triangles shade each other in
// steps that the smooth surface they stand for hasn't.
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// By how far a shadow ray towards w starts off x: onto a smooth surface through the corners, reached by
// projecting x on the tangent planes at the corners (Hanika 2021, "Hacking the Shadow Terminator"). As in
// Cycles only for the rays whose cosines to the shading and to the true normal are small against the mesh's
// `terminator_offset`, with a gradual transition. A bias with a name: 0 for meshes that don't ask for it.
EG_INLINE Vec3 terminator_lift(const SceneView& scene, const SurfacePoint& x, Vec3 shading, Vec3 w) {
    Vec3 lift = zero3();
    if (!scene.any_terminator) return lift;
    const Float cutoff = gather(scene.mesh_terminator, x.mesh);
    const Float smooth = abs(dot(shading, w)), flat = dot(x.normal, w);
    const Float inverse = 1.0f / max(cutoff, 1e-6f);
    Float amount = select(smooth < cutoff, 2.0f - (flat + smooth) * inverse, 1.0f - flat * inverse);
    amount = min(max(amount, 0.0f), splat(1.0f));
    const Mask lifted = x.active & (cutoff > 0.0f) & (amount > 0.0f) & (flat > 0.0f);
    for (int i = 0; i < W; ++i) {
        const int32_t* corner = scene.corner_normal + 3 * static_cast<int64_t>(x.face[i]);
        // Instances' normals would have to be transformed: they are left on their triangles.
        if (!lifted[i] || corner[0] < 0 || corner[1] < 0 || corner[2] < 0 || x.instance[i] >= 0) continue;
        const float b[3] = {1.0f - x.b1[i] - x.b2[i], x.b1[i], x.b2[i]};
        const Vec3 corners[3] = {x.triangle.p0, x.triangle.p1, x.triangle.p2};
        for (int k = 0; k < 3; ++k) {
            const float* n = scene.normals + 3 * static_cast<int64_t>(corner[k]);
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
    }
    return lift;
}

}  // namespace edgegrad::EDGEGRAD_ISA
