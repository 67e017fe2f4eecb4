// Rays against every triangle of a tiny scene: no BVH pays there.
//
// Where a ray passes the three edges is told by their Pluecker products (Shoup 1999; Platis and Theoharis
// 2003): the volume spanned by its direction d and the edge from a to b, seen from its origin o, is
//   d . (a x b) + (o x d) . (b - a).
// A ray meets the triangle iff the three have one sign. Neighbours get the exact negative for their common
// edge, so that no ray slips between them (Embree's queries without its robust flag miss one in twenty rays
// that are aimed at an edge).
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// Whether rays ignore the face, as one of their edge.
EG_INLINE Mask passes_face(const SceneView& scene, const Ignored& ignored, int32_t face) {
    Mask passes = splat(0);
    for (int i = 0; i < W; ++i) {
        if (ignored.edge[i] < 0) continue;
        for (uint32_t k = scene.edge_face_first[ignored.edge[i]];
             k < scene.edge_face_first[ignored.edge[i] + 1]; ++k)
            if (scene.edge_faces[k] == static_cast<uint32_t>(face)) passes[i] = -1;
    }
    return passes;
}

struct BruteHit {
    Mask hit;
    Float distance, b1, b2;
    Int triangle;  // within `brute_triangles`
};

// Tests the rays against each triangle. kAny: until each has met one, whichever; else the nearest.
template <bool kAny>
EG_INLINE BruteHit brute_force(const SceneView& scene, Mask active, Vec3 o, Vec3 d, Float near, Float far,
                               const Ignored& ignored, Int mask) {
    const Vec3 c = cross(o, d);
    const bool ignoring = any(ignored.edge >= 0);
    BruteHit best{splat(0), far, splat(0.0f), splat(0.0f), splat(0)};
    for (int32_t k = 0; k < scene.brute_count; ++k) {
        const BruteTriangle& t = scene.brute_triangles[k];
        Float side[3];
        for (int e = 0; e < 3; ++e) {
            const float* q = t.edge[e];
            side[e] = d.x * q[0] + d.y * q[1] + d.z * q[2] + c.x * q[3] + c.y * q[4] + c.z * q[5];
        }
        const Float low = min(min(side[0], side[1]), side[2]), high = max(max(side[0], side[1]), side[2]);
        Mask hit = active & ((low >= 0.0f) | (high <= 0.0f));
        if (!any(hit)) continue;
        // The three add up to d . normal, but for a triangle that is far away for its size they cancel: a
        // shadow ray that ends just before its light would then meet it. 0 (a ray in the plane) gives a
        // distance that fails the tests.
        const Float inverse = 1.0f / (side[0] + side[1] + side[2]);
        const Float distance = (t.offset - (o.x * t.normal[0] + o.y * t.normal[1] + o.z * t.normal[2])) /
                               (d.x * t.normal[0] + d.y * t.normal[1] + d.z * t.normal[2]);
        hit &= (distance > near) & (distance < best.distance) & ((mask & t.mask) != 0);
        if (ignoring && any(hit)) hit &= ~passes_face(scene, ignored, t.face);
        best.hit |= hit;
        if constexpr (kAny) {
            active &= ~hit;
            if (!any(active)) break;
        } else {
            best.distance = select(hit, distance, best.distance);
            best.b1 = select(hit, side[1] * inverse, best.b1);
            best.b2 = select(hit, side[2] * inverse, best.b2);
            best.triangle = select(hit, splat(k), best.triangle);
        }
    }
    return best;
}

}  // namespace edgegrad::EDGEGRAD_ISA
