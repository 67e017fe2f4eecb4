// Specular shadow term: shadow edges, and edges between surfaces that light each other, seen through chains
// of mirrors and smooth glass (derivations, J).
//
// A chain ends at x, a function of the place s in the picture and of theta. y is a fixed point of a light
// (boundary/specular/chain_light.h). The segment from x to y touches the edge of direction t through e where
//   g(s, theta) = (e - x) . (t x D) = 0,   D the unit direction from x to y.
// With r = |e - x| and lambda = |e - y|/|x - y|
//   -dg/dtheta = (D x t) . (de - lambda dx - (1 - lambda) dy),
// which is formula (S) with the chain's motion for dx. The term sums over the crossings of scan lines with
// this curve (boundary/specular/chain_term.h). y is sampled with the density p with respect to dM:
//   dI = sum over crossings of T f |n_s . D| L_e |n_y . D|/|x - y|^2 /p sigma
//        (-dg/dtheta) |g_k| / (g_x^2 + g_y^2),
// where sigma is the side of the edge's faces relative to D x t. There is no division by r^2, and hard and
// soft shadows are sampled alike. For a y that scatters light, L_e is estimated by a path of the picture.
// -dg/dx = -lambda (D x t) seeds the sweeps of the recorded chain. A light that faces x adds the motion of y
// with x.
#pragma once

#include "boundary/segment/occluder.h"
#include "boundary/segment/touched_field.h"
#include "boundary/specular/chain_curve.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE ChainLight load_light(const ChainCrossings& c, int at, Mask lit) {
    const ChainLight stored = {
        load(c.light_row + at),
        load(c.light_kind + at),
        load(c.light_face + at),
        load(c.light_instance + at),
        load(c.light_scatters + at),
        load(c.light_b1 + at),
        load(c.light_b2 + at),
        {load(c.light_place[0] + at), load(c.light_place[1] + at), load(c.light_place[2] + at)},
        load(c.light_blockers + at),
        load(c.light_visible_to + at),
        load(c.light_density + at)};
    return select(lit, stored, no_chain_light());
}

// The segment from x past the edge of `s` to the light, with D x t = s.normal * s.weight.
struct ShadowWay {
    ChainLightRay light;
    FarEnd y;
    Float lambda;
    Vec3 by_y;  // -dg/dy, or with respect to the direction to y for distant lights
};

EG_INLINE ShadowWay shadow_way(const SceneView& scene, const ChainLight& light, const EdgeSample& s, Vec3 x) {
    ShadowWay way;
    way.light = see_chain_light(scene, s.active, light, x);
    way.y = far_end(scene, light);
    const Float far = way.light.distance, reach = s.view.distance;
    way.lambda = select(far < __builtin_inff(), max(1.0f - reach / max(far, 1e-30f), 0.0f), splat(1.0f));
    way.by_y = s.normal * (s.weight * select(is_distant(way.y), -reach, way.lambda - 1.0f));
    return way;
}

// Adds the part of -dg that is due to the light's motion, times `color`, for the requested parameters.
template <typename Mode>
EG_INLINE void light_blocks(Mode& mode, const SceneView& scene, const DerivativeView& requested,
                            const ChainCrossings& c, int at, const EdgeSample& s, Vec3 x, Vec3 color) {
    const Mask lit = s.active & load(c.lit + at);
    if (!any(lit)) return;
    const ShadowWay way = shadow_way(scene, load_light(c, at, lit), s, x);
    const Mask on_face = lit & (way.y.face >= 0);
    if (any(on_face))
        face_point_blocks(mode, scene, requested, on_face, way.y.face, way.y.instance, way.y.b1, way.y.b2,
                          way.by_y, color);
    far_end_blocks(mode, scene, requested, lit, way.y, x, way.light.w, way.light.distance, way.by_y, color);
}

// Computes the jump at lit crossings from `at` on, without the throughput of their chains and without the
// radiance of surfaces that scatter. `scatters` is x. Sets `by_x` to -dg/dx. Returns the lanes that have a
// jump.
EG_OUTLINE Mask shadow_jump(const SceneView& scene, const ChainCrossings& c, int at, EdgeSample s,
                            const ScatteringPoint& scatters, Vec3& jump, Vec3& by_x) {
    const SurfacePoint& x = scatters.x;
    Mask lit = s.active & x.active;
    const ChainLight light = load_light(c, at, lit);
    s.active = lit;
    const ShadowWay way = shadow_way(scene, light, s, x.position);
    // Keep edges between x and the light that are silhouettes
    lit &= (s.view.distance > 1e-5f * largest_component(s.point)) & (way.lambda > 0.0f) &
           (s.view.distance < way.light.distance);
    SegmentSample p;
    p.active = lit;
    p.edge = s.edge, p.instance = s.instance;
    p.a = s.point - s.tangent * s.u, p.t = s.tangent;
    const Vec3 across = s.normal * s.weight;
    const Mask outline = lit & (load(c.field + at) >= 0), edge = lit & ~outline;
    p.active = edge;
    const Mask clear = transparent_occluder(scene, edge, s.edge);
    Float sigma = splat(-1.0f);  // the field is on the minus side
    if (any(edge))
        sigma = select(outline, sigma, select(clear, splat(1.0f), occluder_side(scene, p, across)));
    lit &= outline | ((sigma != 0.0f) & ~on_edge_face(scene, p, x));
    // Rays touch the field over this length
    const Float contact = select(outline, load(c.contact + at), 0.0f);
    lit &= (s.view.distance > contact) & (s.view.distance + contact < way.light.distance);
    const Vec3 w = way.light.w;
    lit &= scatters.both_sides | (dot(x.normal, w) > 0.0f);
    if (!any(lit)) return lit;
    // The chain itself finds what is followed of the light.
    const Followed followed = followed_for(scene, lit, light.row);
    // Evaluate the light that the edge may occlude
    Vec3 value = scatters.evaluate(scene, lit, w, light.visible_to, followed) *
                 radiance_of(scene, lit, light, way.light, x.mesh) *
                 (sigma * way.light.measure / light.density);
    lit &= largest_component(value) > 0.0f;
    if (!any(lit)) return lit;
    const Mask near = way.light.distance < __builtin_inff();
    PassingRays rays{light.blockers};
    rays.ignored = {select(outline, splat(-1), s.edge), s.instance};
    const Float whole = select(near, way.light.distance * 0.9999f, splat(__builtin_inff()));
    value = value * transmittance(scene, lit, leave_surface(x, w), w,
                                  select(outline, s.view.distance - contact, whole), rays);
    if (any(outline & lit))
        value = select(
            outline,
            value *
                stopped_by_field(scene, outline & lit, load(c.field + at), s.point, s.normal, w, kShadowRay) *
                transmittance(scene, lit & outline, beside_outline(s, w * contact), w,
                              whole - (s.view.distance + contact), rays),
            value);
    if (any(clear & lit))
        value = select(clear, value * transparent_jump(scene, p, lit & clear, s.u, across, w), value);
    jump = select(lit, value, jump);
    // Differentiate g with respect to x
    by_x = select(lit, across * -way.lambda, by_x);
    const Mask on_row = lit & (light.row >= 0) & turns_with_point(light.kind);
    if (any(on_row)) {
        Float row[kLightParams];
        const Vec3 offset = w * select(is_distant(way.y), splat(1.0f), way.light.distance);
        by_x = select(on_row,
                      by_x + light_motion_row(scene.lights, select(on_row, light.row, splat(0)), light.kind,
                                              x.position, offset, way.by_y, row),
                      by_x);
    }
    return lit;
}

}  // namespace edgegrad::EDGEGRAD_ISA
