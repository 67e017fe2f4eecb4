// Intersection of rays with every triangle of a tiny scene, where a BVH does not pay off.
//
// The sides on which a ray passes the three edges are given by Pluecker products (Shoup 1999; Platis and
// Theoharis 2003). For a ray with origin o and direction d and the edge from a to b, the product is
//   d . (a x b) + (o x d) . (b - a).
// The ray hits the triangle iff all three have one sign. Adjacent triangles get exactly opposite values for
// their common edge, so that no ray passes between them. (Embree's queries without its robust flag do miss
// rays that are aimed at an edge.)
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// Lanes whose rays ignore the face, because it belongs to their edge, or lies on an edge.
EG_INLINE Mask passes_face(const SceneView& scene, const Ignored& ignored, int32_t face) {
    if (scene.face_collinear && scene.face_collinear[face]) return ignored.edge >= 0;
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

// Tests the rays against each triangle. kAny: stops when each ray has hit one; else finds the nearest hit.
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
        // The sum of the three products is d . normal, but for distant small triangles it cancels: a shadow
        // ray that ends just before its light would then hit it. So the distance is computed from the plane.
        // For a ray in the plane it is infinite or NaN and fails the tests.
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
