// The curve that the last ray of a chain touches, as crossings have it: an edge, the outline of a field, or
// the line where two surfaces pass through each other.
//
// A ray from p along the unit direction D touches the surface phi = 0 of a distance field where
//   g(s, theta) = min over t of phi(p + t D) / |grad phi| = 0.
// The minimum is at a point e with D . grad phi = 0. So its own motion does not count, and with the unit
// normal n towards the side of the rays that pass, r = |e - p| and m the velocity of the surface
//   -dg/dtheta = n . m - n . dp - r n . dD.
// Edges have N/r in the place of n (boundary/specular/chain_term.h, chain_shadow.h). L- is the radiance of
// the surface at e, seen along its tangent plane, and L+ that of what the ray meets behind it.
//
// Lines of two surfaces are edges whose points lie on both (boundary/terms/field_crossing.h).
#pragma once

#include "boundary/specular/chain_horizon.h"
#include "boundary/terms/field_crossing.h"

namespace edgegrad::EDGEGRAD_ISA {

// Crossings with outlines of fields.
EG_INLINE Mask at_outline(const ChainCrossings& c, int at, int count) {
    return first_lanes(count - at) & (load(c.field + at) >= 0);
}

// Crossings with lines of two surfaces.
EG_INLINE Mask at_line(const ChainCrossings& c, int at, int count) {
    return first_lanes(count - at) & (load(c.crossed_face[0] + at) >= 0);
}

// The point of the line of two surfaces.
EG_OUTLINE CrossingSample crossed_surfaces(const SceneView& scene, const ChainCrossings& c, int at,
                                           Mask line) {
    CrossingSample x;
    load3(x.position, c.curve_point, at);
    x.reversed = splat(0);
    for (int k = 0; k < 2; ++k) {
        CrossedSide& side = x.side[k];
        side.face = select(line, load(c.crossed_face[k] + at), splat(0));
        side.instance = select(line, load(c.crossed_instance[k] + at), splat(-1));
        side.field = on_field(scene, line, side.face);
        const Triangle t = placed_triangle(scene, side.face, side.instance).triangle;
        side.normal = unit_normal(t);
        place_in_face(t, x.position, side.b1, side.b2);
        set_places(scene, side.field, side.face, x.position, side.b1, side.b2);
        for (int i = 0; i < W; ++i) {
            if (!side.field[i]) continue;
            const FieldView& field = field_of_face(scene, side.face[i]);
            set_lane3(side.normal, i, unit_normal(crossed_field(field), vector_of(x.position, i)));
        }
    }
    x.tangent = cross(x.side[0].normal, x.side[1].normal);
    return x;
}

// The curve as seen from the origin of the chain's last ray.
EG_INLINE EdgeSample chain_curve(const SceneView& scene, const ChainCrossings& c, int at, int count,
                                 Vec3 from, Vec3 origin) {
    EdgeSample s;
    const Mask outline = at_outline(c, at, count), line = at_line(c, at, count),
               edge = first_lanes(count - at) & (load(c.edge + at) >= 0);
    s.active = edge | outline | line;
    s.edge = select(edge, load(c.edge + at), splat(0));
    s.instance = select(edge, load(c.edge_instance + at), splat(-1));
    s.intersection = splat(0);
    s.u = select(edge, load(c.u + at), 0.0f);
    s.end = s.tangent = zero3();
    if (any(edge)) gather_edges(scene, s.edge, s.instance, s.end, s.tangent);
    s.point = s.end + s.tangent * s.u;
    if (any(outline | line)) {
        Vec3 point;
        load3(point, c.curve_point, at);
        s.point = select(edge, s.point, point);
        s.tangent = select(edge, s.tangent, zero3());
    }
    if (any(line)) s.tangent = select(line, crossed_surfaces(scene, c, at, line).tangent, s.tangent);
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
    const Mask line = s.active & (load(c.crossed_face[0] + at) >= 0);
    if (any(line)) crossing_blocks(mode, scene, motion, line, s, crossed_surfaces(scene, c, at, line), color);
    s.active &= ~(outline | line);
    if (any(s.active)) edge_blocks(mode, scene, motion, s, color);
}

// The start of a ray that passes an outline, slightly beside the surface and `step` from the point.
EG_INLINE Vec3 beside_outline(const EdgeSample& s, Vec3 step) {
    return s.point + s.normal * (4e-6f * largest_component(s.point)) + step;
}

// Appends the paths `number` that have met a hit on one side of a curve, behind transparent surfaces.
EG_OUTLINE int append_side(Workspace& work, int queued, const EdgeSample& s, PathPacket p,
                           const Behind& behind, Int number, Vec3 along, const Closest& hit, Vec3 step) {
    p.active = s.active;
    p.path = number;
    p.origin = p.from = s.view.origin;
    p.direction = along;
    p.throughput = p.throughput * behind.through;
    p.vertex = p.vertex + behind.passed;
    p.bounces = p.bounces + (behind.passed << 24);
    return append_met(work, queued, p, hit, step);
}

// Appends paths for both sides of outlines that are seen along the rays of `s`. `p`: the chains' paths as
// they arrive there. Samples whose outline is hidden become inactive. Returns the queue's length.
EG_OUTLINE int see_outline(const SceneView& scene, const BoundaryTask& task, const ChainCrossings& c, int at,
                           EdgeSample& s, const PathPacket& p, Workspace& work, int queued) {
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
    set_places(scene, s.active, face, s.point, hit.b1, hit.b2);
    const Int plus = lane_index() + at;
    queued = append_side(work, queued, s, p, behind, plus + static_cast<int>(task.count),
                         onto_surface(s.view.direction, s.normal), hit, zero3());
    return append_side(work, queued, s, p, behind, plus, s.view.direction, behind.hit, zero3());
}

// The surfaces of a line, each of which a ray to it meets once.
struct CrossedPair : CrossedFields {
    EG_INLINE Ignored ignored(const EdgeSample&) const { return ignore_nothing(); }
};

// The same for lines of two surfaces.
EG_OUTLINE int see_line(const SceneView& scene, const BoundaryTask& task, const ChainCrossings& c, int at,
                        EdgeSample& s, const PathPacket& p, Workspace& work, int queued) {
    constexpr float kNearFaces = 1e-2f;
    const CrossingSample x = crossed_surfaces(scene, c, at, s.active);
    const Int plus = nearer_beside(s, x);
    CrossedPair own{{{x.side[0].face, x.side[1].face}, {}}};
    s.active = reached_first(scene, s.active, x, s.view.direction, own.contact);
    if (!any(s.active)) return queued;
    for (int k = 0; k < 2; ++k)
        own.contact[k] = select(x.side[k].field, own.contact[k], s.view.distance * kNearFaces);
    const Behind before = look_behind(scene, s, crossed_sides(x), task.limits.transparent, own);
    if (!any(s.active)) return queued;
    const auto start = [&](int k, const Closest& hit, Vec3 step) EG_INLINE_LAMBDA {
        queued = append_side(work, queued, s, p, before,
                             lane_index() + at + (k == 0 ? 0 : static_cast<int>(task.count)),
                             s.view.direction, hit, step);
    };
    start_on_both_sides(scene, s, x, plus, start);
    return queued;
}

}  // namespace edgegrad::EDGEGRAD_ISA
