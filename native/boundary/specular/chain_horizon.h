// Horizons of smooth-shaded faces in mirrors and glass: where a chain's last ray leaves a face along its
// plane.
//
// A mirror or smooth glass whose normals are interpolated sends some rays into itself, past the horizon of
// the face that stands for it: nothing comes from there. With D the ray from the chain's last vertex and n
// the normal of its face F, towards the side on which rays go on, that happens where
//   g(s, theta) = D . n = 0,   -dg/dtheta = -n . dD + n . (m_F(p + D) - m_F(p)),
// m_F the velocity of F's points, extended over its plane (derivations, H): D lies in it. L- = 0 there, and
// L+ is what comes along D (boundary/specular/chain_term.h).
// Where two faces of one mesh meet, and only one of them sends its rays on, it is their edge that the ray to
// them touches, as any other edge; what jumps is the same.
#pragma once

#include "boundary/samples/visible_edge.h"
#include "boundary/specular/chain.h"
#include "boundary/terms/horizon.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// What a chain met last.
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
    return first_lanes(count - at) & (load(c.edge + at) < 0);
}

// Sets -dg by the rays that go on.
EG_INLINE void horizon_slopes(ChainCrossings& c, int at, Mask active, const ChainRay& ray,
                              const PathPacket& p) {
    const Vec3 n = select(ray.kind == static_cast<int>(kTransmissionRay), -p.from_normal, p.from_normal);
    put3(c.by_point, at, active, zero3()), put3(c.by_direction, at, active, -n);
    put3(c.from, at, active, ray.from), put3(c.direction, at, active, ray.direction);
}

// Of faces that the edge of `s` parts, lanes in which the last vertex is on the side where g > 0.
EG_INLINE Mask is_plus_side(const SceneView& scene, const ChainCrossings& c, int at, Mask parted,
                            const EdgeSample& s) {
    const LastVertex v = last_vertex(c, at, parted);
    const Triangle t = placed_triangle(scene, v.face, v.instance).triangle;
    return dot(s.normal, t.p0 + t.p1 + t.p2 - s.point * splat(3.0f)) > 0.0f;
}

// Queues the rays that go on, with the numbers `path`.
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

// The part of -dg by the faces, times the color, for what `asked` names.
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
