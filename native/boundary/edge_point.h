// Light at a point of an edge: what the surfaces that meet there hide.
//
// Rays from a point of an edge ignore all faces of that edge, since they start on them, and the surface
// in which the edge lies, if there is one (contact: a box that stands on a floor). Whether one of these
// hides direction w is decided here, in the plane across the edge: with angles measured from the
// point's own surface F towards w's side, a face G hides w iff 0 < angle(G) < angle(w) < pi
// (derivations A4). The touched surface counts as two faces, one to each side (F3b).
#pragma once

#include "scene/rays.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Mask hidden_by_edge(const SceneView& scene, Mask active, const SurfacePoint& x, Vec3 w) {
    const Mask on_edge = active & (x.ignored.edge >= 0);
    Mask hidden = splat(0);
    if (!any(on_edge)) return hidden;
    const Float w_normal = dot(w, x.normal), w_along = dot(w, x.along);
    for (int i = 0; i < W; ++i) {
        if (!on_edge[i]) continue;
        const int32_t edge = x.ignored.edge[i];
        const float* a = scene.vertices + 3 * static_cast<int64_t>(scene.edge_vertices[2 * edge]);
        const float n[3] = {x.normal.x[i], x.normal.y[i], x.normal.z[i]};
        const float f[3] = {x.along.x[i], x.along.y[i], x.along.z[i]};
        for (uint32_t k = scene.edge_face_first[edge]; k < scene.edge_face_first[edge + 1]; ++k) {
            if (static_cast<int32_t>(scene.edge_faces[k]) == x.face[i]) continue;
            const float* c = scene.vertices + 3 * static_cast<int64_t>(scene.edge_opposite[k]);
            const float g[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
            const float gn = g[0] * n[0] + g[1] * n[1] + g[2] * n[2];
            const float gf = g[0] * f[0] + g[1] * f[1] + g[2] * f[2];
            // Both angles are in (0, pi): G comes before w iff it is to the right of it.
            if (gn > 0.0f && gf * w_normal[i] - gn * w_along[i] > 0.0f) hidden[i] = -1;
        }
    }
    const Mask touching = on_edge & (x.ignored.face >= 0) & (x.ignored.face != x.face);
    if (any(touching)) {
        // The half plane of the touched surface on the side of n: t x n_touched, turned.
        const Vec3 m = area_normal(gather_triangle(scene, select(touching, x.ignored.face, splat(0))));
        const Vec3 t = cross(x.normal, x.along);
        Vec3 g = cross(t, m);
        g = select(dot(g, x.normal) < 0.0f, -g, g);
        const Float gn = dot(g, x.normal), gf = dot(g, x.along);
        hidden |= touching & (gn > 0.0f) & (gf * w_normal - gn * w_along > 0.0f);
    }
    return hidden;
}

}  // namespace edgegrad::EDGEGRAD_ISA
