// Specular term at the horizon of smooth-shaded faces: places in the picture where a chain's last ray leaves
// a face along its plane (derivations, J and H).
//
// A mirror or smooth glass with interpolated normals scatters some rays below the horizon of their face.
// These rays carry no light. With p the last vertex, D the direction of the ray from it, and n the normal of
// its face F towards the side of continuing rays, this begins where
//   g(s, theta) = D . n = 0,   -dg/dtheta = -n . dD + n . (m_F(p + D) - m_F(p)).
// m_F is the velocity of F's points, extended affinely over its plane, in which D lies. L- = 0, and L+ is the
// radiance along D (boundary/specular/chain_term.h). The normal of a distance field also turns as p slides:
// with its Hessian H and its gradient f along n at p,
//   -dg/dtheta = -n . dD - D . (H dp + grad dphi) / |f|.
//
// If the ray continues from only one of two adjacent faces, the curve is that of their edge and of the ray
// that touches it, as for any other edge. The jump of radiance is the same.
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
           (load(c.crossed_face[0] + at) < 0) & (load(c.outlined_light + at) < 0);
}

// Stores the slopes -dg with respect to the continuing rays.
EG_INLINE void horizon_slopes(const SceneView& scene, ChainCrossings& c, int at, Mask active,
                              const ChainRay& ray, const PathPacket& p) {
    const Vec3 n = select(ray.kind == static_cast<int>(kTransmissionRay), -p.from_normal, p.from_normal);
    const Int face = last_vertex(c, at, active).face;
    Vec3 by_point = zero3();
    for (int i = 0; i < W; ++i) {
        if (!active[i] || !is_on_field(scene, face[i])) continue;
        const FieldJet x =
            field_jet(field_of_face(scene, face[i]), {ray.from.x[i], ray.from.y[i], ray.from.z[i]});
        const auto& g = x.gradient;
        const auto& h = x.hessian;
        const float w[3] = {ray.direction.x[i], ray.direction.y[i], ray.direction.z[i]};
        const float along = g[0] * n.x[i] + g[1] * n.y[i] + g[2] * n.z[i];  // |f| or -|f|
        const float scale = along == 0.0f ? 0.0f : -1.0f / along;
        by_point.x[i] = scale * (h[0] * w[0] + h[5] * w[1] + h[4] * w[2]);
        by_point.y[i] = scale * (h[5] * w[0] + h[1] * w[1] + h[3] * w[2]);
        by_point.z[i] = scale * (h[4] * w[0] + h[3] * w[1] + h[2] * w[2]);
    }
    put3(c.by_point, at, active, by_point), put3(c.by_direction, at, active, -n);
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
    const Closest hit =
        intersect(scene, active, ray.origin, ray.direction, splat(0.0f), splat(__builtin_inff()),
                  ignore_nothing(), embree::kIncoherent, ray_mask(ray.kind));
    return append_met(work, queued, side, hit, zero3());
}

// Adds the part of -dg that is due to the face's motion, times the color, for the requested parameters.
template <typename Mode>
EG_INLINE void chain_horizon_blocks(Mode& mode, const SceneView& scene, const DerivativeView& requested,
                                    const ChainCrossings& c, int at, Mask active, Vec3 color) {
    if (!any(active)) return;
    const LastVertex v = last_vertex(c, at, active);
    Vec3 n, towards;  // n: against the normal
    load3(n, c.by_direction, at);
    load3(towards, c.direction, at);
    const Mask field = on_field(scene, active, v.face);
    if (any(field) && requested.fields.any()) {
        Triangle t = placed_triangle(scene, v.face, v.instance).triangle;
        Float b1 = v.b1, b2 = v.b2;
        settle_on_fields(scene, field, v.face, t, b1, b2);
        mode.field(field, v.face, t.p0, select(dot(n, area_normal(t)) < 0.0f, -towards, towards), color,
                   FieldMotion::kNormal);
    }
    face_turn_blocks(mode, scene, requested, active & ~field, v.face, v.instance, v.b1, v.b2, towards, -n,
                     color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
