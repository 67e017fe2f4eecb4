// Light at a point of an edge: what the other faces of the same edge hide.
#pragma once

#include "scene/rays.h"

namespace edgegrad::EDGEGRAD_ISA {

// Rays from a point of an edge ignore all faces of that edge, since they start on them; whether one
// of them hides direction w is decided here, in the plane across the edge: with angles measured from
// the point's own face F towards w's side, a face G hides w iff 0 < angle(G) < angle(w) < pi
// (derivations A4).
EG_INLINE Mask hidden_by_edge(const SceneView& scene, Mask active, const SurfacePoint& x, Vec3 w) {
    const Mask on_edge = active & (x.edge >= 0);
    Mask hidden = splat(0);
    if (!any(on_edge)) return hidden;
    for (int i = 0; i < W; ++i) {
        if (!on_edge[i]) continue;
        const int32_t edge = x.edge[i];
        const uint32_t first = scene.edge_face_first[edge], last = scene.edge_face_first[edge + 1];
        const float* a = scene.vertices + 3 * static_cast<int64_t>(scene.edge_vertices[2 * edge]);
        const float* b = scene.vertices + 3 * static_cast<int64_t>(scene.edge_vertices[2 * edge + 1]);
        const float t[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const float tt = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
        const float n[3] = {x.normal.x[i], x.normal.y[i], x.normal.z[i]};
        const float d[3] = {w.x[i], w.y[i], w.z[i]};
        float f[3] = {0, 0, 0};  // in F, across the edge, away from it
        for (uint32_t k = first; k < last; ++k) {
            if (static_cast<int32_t>(scene.edge_faces[k]) != x.face[i]) continue;
            const float* c = scene.vertices + 3 * static_cast<int64_t>(scene.edge_opposite[k]);
            const float g[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
            const float along = (g[0] * t[0] + g[1] * t[1] + g[2] * t[2]) / tt;
            for (int j = 0; j < 3; ++j) f[j] = g[j] - along * t[j];
        }
        const float wn = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
        const float wf = d[0] * f[0] + d[1] * f[1] + d[2] * f[2];
        for (uint32_t k = first; k < last; ++k) {
            if (static_cast<int32_t>(scene.edge_faces[k]) == x.face[i]) continue;
            const float* c = scene.vertices + 3 * static_cast<int64_t>(scene.edge_opposite[k]);
            const float g[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
            const float gn = g[0] * n[0] + g[1] * n[1] + g[2] * n[2];
            const float gf = g[0] * f[0] + g[1] * f[1] + g[2] * f[2];
            // Both angles are in (0, pi): G comes before w iff it is to the right of it.
            if (gn > 0.0f && gf * wn - gn * wf > 0.0f) hidden[i] = -1;
        }
    }
    return hidden;
}

}  // namespace edgegrad::EDGEGRAD_ISA
