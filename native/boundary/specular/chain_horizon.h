// Specular term at the horizon of smooth-shaded faces: places in the picture where a chain's last ray leaves
// a face along its plane (derivations, J and H).
//
// A mirror or smooth glass with interpolated normals scatters some rays below the horizon of their face.
// These rays carry no light. With p the last vertex, D the direction of the ray from it, and n the normal of
// its face F towards the side of continuing rays, this begins where
//   g(s, theta) = D . n = 0,   -dg/dtheta = -n . dD + n . (m_F(p + D) - m_F(p)).
// m_F is the velocity of F's points, extended affinely over its plane, in which D lies. L- = 0, and L+ is the
// radiance along D (boundary/specular/chain_term.h). If the ray continues from only one of two adjacent
// faces, the curve is that of their edge and of the ray that touches it, as for any other edge. The jump of
// radiance is the same.
#pragma once

#include "boundary/samples/visible_edge.h"
#include "boundary/specular/chain.h"
#include "boundary/terms/horizon.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// The last vertex of a chain.
struct LastVertex {
    Int face, mesh, instance, closure;
    Float b1, b2;
};

EG_INLINE LastVertex last_vertex(const ChainCrossings& c, int at, Mask active) {
    LastVertex v{splat(0), splat(0), splat(-1), splat(0), splat(0.0f), splat(0.0f)};
    const Int last = select(active, load(c.length + at) - 1, splat(0));
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const int k = last[i];
        v.face[i] = c.face[k][at + i], v.mesh[i] = c.mesh[k][at + i], v.closure[i] = c.closure[k][at + i];
        v.instance[i] = c.instance[k][at + i];
        v.b1[i] = c.b1[k][at + i], v.b2[i] = c.b2[k][at + i];
    }
    return v;
}

// Crossings with horizons.
EG_INLINE Mask at_horizon(const ChainCrossings& c, int at, int count) {
    return first_lanes(count - at) & (load(c.edge + at) < 0) & (load(c.field + at) < 0) &
           (load(c.crossed_face[0] + at) < 0);
}

// Stores the slopes -dg with respect to the continuing rays.
EG_INLINE void horizon_slopes(ChainCrossings& c, int at, Mask active, const ChainRay& ray,
                              const PathPacket& p) {
    const Vec3 n = select(ray.kind == static_cast<int>(kTransmissionRay), -p.from_normal, p.from_normal);
    put3(c.by_point, at, active, zero3()), put3(c.by_direction, at, active, -n);
    put3(c.from, at, active, ray.from), put3(c.direction, at, active, ray.direction);
}

// For edges between two faces of which one ends the ray: lanes whose last vertex is on the side where g > 0.
EG_INLINE Mask is_plus_side(const SceneView& scene, const ChainCrossings& c, int at, Mask parted,
                            const EdgeSample& s) {
    const LastVertex v = last_vertex(c, at, parted);
    const Triangle t = placed_triangle(scene, v.face, v.instance).triangle;
    return dot(s.normal, t.p0 + t.p1 + t.p2 - s.point * splat(3.0f)) > 0.0f;
}

// Appends the continuing rays to the queue of paths, with the numbers `path`.
EG_OUTLINE int see_onwards(const SceneView& scene, Mask active, const ChainRay& ray, const PathPacket& p,
                           Int path, Workspace& work, int queued) {
    PathPacket side = p;
    side.active = active;
    side.path = path;
    side.origin = ray.origin, side.from = ray.from, side.direction = ray.direction;
    Closest none;
    none.hit = splat(0);
    none.face = splat(0);
    none.b1 = none.b2 = splat(0.0f);
    const Closest hit =
        intersect(scene, active, ray.origin, ray.direction, splat(0.0f), splat(__builtin_inff()),
                  ignore_nothing(), embree::kIncoherent, ray_mask(ray.kind));
    return append_met(work, queued, side, hit, zero3(), none);
}

// Adds the part of -dg that is due to the face's motion, times the color, for the requested parameters.
template <typename Mode>
EG_INLINE void chain_horizon_blocks(Mode& mode, const SceneView& scene, const DerivativeView& requested,
                                    const ChainCrossings& c, int at, Mask active, Vec3 color) {
    if (!any(active)) return;
    const LastVertex v = last_vertex(c, at, active);
    Vec3 n, towards;
    load3(n, c.by_direction, at);
    load3(towards, c.direction, at);
    face_turn_blocks(mode, scene, requested, active, v.face, v.instance, v.b1, v.b2, towards, -n, color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
