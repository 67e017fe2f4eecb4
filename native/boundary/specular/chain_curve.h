// The curve that the last ray of a chain touches, as crossings have it: an edge, or the outline of a field.
//
// A ray from p along the unit direction D touches the surface phi = 0 of a distance field where
//   g(s, theta) = min over t of phi(p + t D) / |grad phi| = 0.
// The minimum is at a point e with D . grad phi = 0. So its own motion does not count, and with the unit
// normal n towards the side of the rays that pass, r = |e - p| and m the velocity of the surface
//   -dg/dtheta = n . m - n . dp - r n . dD.
// Edges have N/r in the place of n (boundary/specular/chain_term.h, chain_shadow.h). L- is the radiance of
// the surface at e, seen along its tangent plane, and L+ that of what the ray meets behind it.
#pragma once

#include "boundary/samples/outline_samples.h"
#include "boundary/specular/chain_horizon.h"
#include "boundary/terms/primary.h"

namespace edgegrad::EDGEGRAD_ISA {

// Crossings with outlines of fields.
EG_INLINE Mask at_outline(const ChainCrossings& c, int at, int count) {
    return first_lanes(count - at) & (load(c.field + at) >= 0);
}

// The curve as seen from the origin of the chain's last ray.
EG_INLINE EdgeSample chain_curve(const SceneView& scene, const ChainCrossings& c, int at, int count,
                                 Vec3 from, Vec3 origin) {
    EdgeSample s;
    const Mask outline = at_outline(c, at, count), edge = first_lanes(count - at) & (load(c.edge + at) >= 0);
    s.active = edge | outline;
    s.edge = select(edge, load(c.edge + at), splat(0));
    s.instance = select(edge, load(c.edge_instance + at), splat(-1));
    s.intersection = splat(0);
    s.u = select(edge, load(c.u + at), 0.0f);
    s.end = s.tangent = zero3();
    if (any(edge)) gather_edges(scene, s.edge, s.instance, s.end, s.tangent);
    s.point = s.end + s.tangent * s.u;
    if (any(outline)) {
        Vec3 point;
        load3(point, c.outline_point, at);
        s.point = select(outline, point, s.point);
        s.tangent = select(outline, zero3(), s.tangent);
    }
    const Vec3 way = s.point - origin;
    Projection& v = s.view;
    v.active = s.active;
    v.origin = origin;
    v.distance = sqrt(dot(way, way));
    v.direction = way * (1.0f / max(v.distance, 1e-30f));
    v.near = splat(0.0f), v.far = splat(__builtin_inff());
    v.across_of = s.point - from;
    s.normal = cross(v.across_of, s.tangent);
    s.weight = 1.0f / max(sqrt(dot(v.across_of, v.across_of)), 1e-30f);
    if (any(outline)) {
        Vec3 normal;
        load3(normal, c.outline_normal, at);
        s.normal = select(outline, normal, s.normal);
        s.weight = select(outline, splat(1.0f), s.weight);
    }
    s.active &= v.distance > 0.0f;
    s.random.pixel = splat(0);
    s.random.sample = bits(lane_index());
    s.random.stream = bits(splat(0));
    return s;
}

// The fields of outlines, and 0.
EG_INLINE Int outlined_field(const ChainCrossings& c, int at, Mask outline) {
    return select(outline, load(c.field + at), splat(0));
}

// The part of -dg that is due to the curve's motion, times `color`, for the requested parameters.
template <typename Mode>
EG_INLINE void curve_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                            const ChainCrossings& c, int at, EdgeSample s, Vec3 color) {
    const Mask outline = s.active & (load(c.field + at) >= 0);
    if (any(outline) && motion.fields.any())
        mode.field(outline, outlined_field(c, at, outline), s.point, s.normal, color);
    s.active &= ~outline;
    if (any(s.active)) edge_blocks(mode, scene, motion, s, color);
}

// The start of a ray that passes an outline, slightly beside the surface and `step` from the point.
EG_INLINE Vec3 beside_outline(const EdgeSample& s, Vec3 step) {
    return s.point + s.normal * (4e-6f * largest_component(s.point)) + step;
}

// Appends paths for both sides of outlines that are seen along the rays of `s`. `p`: the chains' paths as
// they arrive there. Samples whose outline is hidden become inactive. Returns the queue's length.
EG_OUTLINE int see_outline(const SceneView& scene, const BoundaryTask& task, const ChainCrossings& c, int at,
                           EdgeSample& s, PathPacket p, Workspace& work, int queued) {
    const SideFace none = {splat(-1), splat(-1), splat(0), splat(0.0f)};
    const Int face = outlined_field(c, at, s.active);
    const Behind behind = look_behind(scene, s, {none, none, splat(0)}, task.limits.transparent,
                                      GrazedField{face, load(c.contact + at)});
    if (!any(s.active)) return queued;
    Closest hit;
    hit.hit = s.active;
    hit.face = face;
    hit.mesh = mesh_of(scene, face);
    hit.instance = splat(-1);
    hit.b1 = hit.b2 = splat(0.0f);
    hit.distance = s.view.distance;
    for (int i = 0; i < W; ++i) {
        if (!s.active[i]) continue;
        const FieldView& field = field_of_face(scene, face[i]);
        const float point[3] = {s.point.x[i], s.point.y[i], s.point.z[i]};
        double grid[3];
        field.place_in_grid(point, grid);
        set_place(field, grid, i, hit.b1, hit.b2);
    }
    p.active = s.active;
    p.origin = p.from = s.view.origin;
    p.throughput = p.throughput * behind.through;
    p.vertex = p.vertex + behind.passed;
    p.bounces = p.bounces + (behind.passed << 24);
    Closest no_other = hit;
    no_other.hit = splat(0);
    const auto start = [&](Int number, Vec3 along, const Closest& first) EG_INLINE_LAMBDA {
        p.path = number, p.direction = along;
        queued = append_met(work, queued, p, first, zero3(), no_other);
    };
    const Int plus = lane_index() + at;
    start(plus + static_cast<int>(task.count), onto_surface(s.view.direction, s.normal), hit);
    start(plus, s.view.direction, behind.hit);
    return queued;
}

}  // namespace edgegrad::EDGEGRAD_ISA
