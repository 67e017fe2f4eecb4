// Pierced surfaces: what changes where a surface hides a part of another that it passes through, and that
// gives light or passes it on.
//
// The line along which a surface i pierces another one j, or a light, bounds the part of j that a point x
// sees. Formula (S) of the derivations (boundary/segment/segment.h) with the line for an edge and y on it:
// lambda = 0, so that x's own motion drops out (F2),
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (dq - dy),
// q the line's point at u, w any direction, x the first surface along it. y rides on j, and q is on both
// planes: with g = sigma (t x w) = mu_i n_i + mu_j n_j,
//   g . dq = mu_i n_i . m_i(q) + mu_j n_j . m_j(q)     (boundary/samples/intersection_point.h).
// Where j gives light whose direction is held (shading/lights/fixed_direction_light.h), lambda = 1 and dx
// takes the place of dy; near x it does by a share (scene/contact.h). Of a sphere n_j is its normal at q, and
// y has a place in the cone in which x sees it, so that dx counts; where disks are cut that face x, which
// depends on x, is looked for from there (boundary/terms/disk_intersection.h). What x doesn't see of j is on
// the side of i's plane that is away from x: sigma = sign((t x w) . h) with h in j across the line, (n_i . h)
// (n_i . w) < 0. L(y) is what j gives by itself (the shadow term), or what it scatters, which the path tracer
// finds (the indirect one).
#pragma once

#include "boundary/samples/light_cut.h"
#include "boundary/segment/far_radiance.h"
#include "boundary/segment/occluder.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/silhouette.h"
#include "shading/lights/light_radiance.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// The two surfaces of a line, as the one that hides and the one that is hidden.
struct IntersectingPair {
    Int hider, face;               // face -1: a light
    Int hider_instance, instance;  // that place them
    Int row;                       // of the light table; -1: a face
    Vec3 hider_normal, normal;
    Float weight;  // by the probability of the choice
};

struct IntersectionSegment : BoundarySegment {
    IntersectingPair pair;
};

// One of the surfaces that may be hidden: of the shadow term only what gives light is.
EG_INLINE IntersectingPair pick_intersection(const SceneView& scene, const BoundaryTask& task,
                                             const SegmentSample& p) {
    IntersectingPair pair;
    Float choice, unused;
    sobol_pair(p.random.stream, p.random.sample, kPairLight, choice, unused);
    pair.row = splat(-1);
    for (int i = 0; i < W; ++i) {
        const LineSurface surfaces[2] = {scene.surface_of_line(p.edge[i], 0),
                                         scene.surface_of_line(p.edge[i], 1)};
        // Lights of the table, which come second, are hidden and hide nothing.
        bool counts[2] = {false, true};
        for (int k = 0; k < 2; ++k)
            if (!surfaces[0].is_light() && !surfaces[1].is_light())
                counts[k] = task.kind == kSurfaceIntersection ||
                            (scene.lights.face_light && scene.lights.face_light[surfaces[k].face()] >= 0);
        const int k = counts[0] && (!counts[1] || choice[i] < 0.5f) ? 0 : 1;
        pair.weight[i] = counts[0] && counts[1] ? 2.0f : 1.0f;
        const bool light = surfaces[k].is_light();
        pair.hider[i] = surfaces[1 - k].face();
        pair.hider_instance[i] = face_instance(scene, p.edge[i], -1, static_cast<uint32_t>(1 - k));
        pair.instance[i] = light ? -1 : face_instance(scene, p.edge[i], -1, static_cast<uint32_t>(k));
        pair.face[i] = light ? -1 : surfaces[k].face();
        if (light) pair.row[i] = surfaces[k].light_row();
    }
    const Int hidden_face = select(pair.row >= 0, splat(0), pair.face);
    pair.hider_normal = unit_normal(placed_triangle(scene, pair.hider, pair.hider_instance).triangle);
    pair.normal = unit_normal(placed_triangle(scene, hidden_face, pair.instance).triangle);
    return pair;
}

// A direction, uniform about the line, in the piece's cell of directions.
EG_INLINE Vec3 direction_about(const BoundaryTask& task, const SegmentSample& p, Float& density) {
    Float u, v;
    density = splat(kInvFourPi * cell_numbers(task, p, u, v));
    const Vec3 axis = p.t * (1.0f / max(sqrt(dot(p.t, p.t)), 1e-30f));
    Vec3 a, b;
    basis(axis, a, b);
    Float s, c;
    sincos_turn(min(v, splat(0.99999994f)), s, c);
    const Float along = 2.0f * u - 1.0f, across = sqrt(max(1.0f - along * along, 0.0f));
    return axis * along + (a * c + b * s) * across;
}

// Where a line cuts a light of the table: its point, the light's normal there and, in `p`, its direction.
EG_INLINE void cut_light_row(const SceneView& scene, IntersectionSegment& s, SegmentSample& p) {
    const Mask on_row = s.active & (s.pair.row >= 0);
    if (!any(on_row)) return;
    const LightRow l = gather_light(scene.lights, select(on_row, s.pair.row, splat(0)));
    const LightCut cut = light_cut(l, s.y.kind, s.point, p.t, s.pair.hider_normal);
    s.point = select(on_row, cut.point, s.point);
    p.t = select(on_row, cut.tangent, p.t);
    s.pair.normal = select(on_row, cut.normal, s.pair.normal);
}

// A sphere shows its outside to those who are outside, its inside to those who are inside: lanes where x, at
// s.reach from y, doesn't see y.
EG_INLINE Mask sees_other_side(const SceneView& scene, const IntersectionSegment& s, Vec3 w) {
    const Mask round = s.active & (s.y.kind == splat(static_cast<int>(kSphereLight)));
    if (!any(round)) return round;
    const LightRow l = gather_light(scene.lights, select(round, s.pair.row, splat(0)));
    // Inwards, x is inside up to the chord's other end.
    const Float outwards = dot(s.pair.normal, w);
    return round & (outwards < 0.0f) & (s.reach >= -2.0f * l.radius * outwards);
}

// Light that y gives by itself along w, and what stops it.
EG_INLINE Vec3 light_of_intersection(const SceneView& scene, const IntersectingPair& pair,
                                     const BoundarySegment& s, Vec3 w) {
    const Mask on_row = s.active & (pair.row >= 0), on_face = s.active & ~on_row;
    Vec3 light = zero3();
    if (any(on_row)) {
        const LightRow l = gather_light(scene.lights, select(on_row, pair.row, splat(0)));
        const Mask round = s.y.kind == splat(static_cast<int>(kSphereLight));
        const Mask shines = on_row & (round | (dot(w, l.direction) > 0.0f));
        light = select(shines, l.radiance * light_factor(l, -w), light);
    }
    if (any(on_face)) {
        const SurfacePoint y = surface_point(scene, on_face, select(on_face, pair.face, splat(0)), s.y.b1,
                                             s.y.b2, -w, select(on_face, pair.instance, splat(-1)));
        const Int kind = splat(static_cast<int>(kCameraRay));
        light = select(on_face, emitted_radiance(scene, y, texture_point(scene, y, w, kind)), light);
    }
    return light;
}

// Sets what moves across the segment of light along w: the light's side of the line is hidden that is behind
// the hider's plane, to which what is returned points.
EG_INLINE Vec3 hide_beside(Vec3 t, Vec3 w, IntersectionSegment& s) {
    const Vec3 across = cross(t, w);
    const Float facing = dot(s.pair.hider_normal, w);
    Vec3 hidden = cross(s.pair.normal, t);
    hidden = select(dot(s.pair.hider_normal, hidden) * facing > 0.0f, -hidden, hidden);
    s.sweep = select(dot(across, hidden) < 0.0f, -across, across);
    s.active &= (facing != 0.0f) & (dot(s.pair.normal, w) != 0.0f);
    return hidden;
}

// A sample but for the light that y scatters, whose path is appended to the queue; its new length.
EG_OUTLINE int sample_intersection(const SceneView& scene, const BoundaryTask& task,
                                   const DerivativeView& motion, int at, SegmentCursor& piece,
                                   Workspace& work, int queued, IntersectionSegment& s) {
    SegmentSample p = sample_edge_segment(scene, task, at, piece);
    const bool scatters = task.kind == kSurfaceIntersection;
    s.color = zero3();
    s.view.sx = s.view.sy = splat(kNowhere);
    s.active = p.active;
    s.edge = p.edge;
    s.instance = splat(-1);
    s.u = p.u0 + (p.u1 - p.u0) * p.tau;
    s.point = p.a + p.t * s.u;
    s.distance = s.lambda = splat(0.0f);
    s.y = still_far_end();
    const IntersectingPair& pair = s.pair = pick_intersection(scene, task, p);
    s.y.face = pair.face, s.y.instance = pair.instance, s.y.row = pair.row;
    s.y.kind = kind_of_rows(scene.lights, pair.row);
    cut_light_row(scene, s, p);
    Mask moves = face_point_moves(scene, motion, s.active, pair.hider, pair.hider_instance) |
                 face_point_moves(scene, motion, s.active & (pair.face >= 0), pair.face, pair.instance);
    if (motion.lights_requested) moves |= s.active & (pair.row >= 0);
    // x may be what moves.
    if (scene.mesh_contact || (!scatters && scene.face_held)) moves = s.active;
    moves |= s.active & (pair.row >= 0) & turns_with_point(s.y.kind);
    s.active &= moves;
    if (!any(s.active)) return queued;

    Float density;
    const Vec3 w = direction_about(task, p, density);
    s.towards = -w;
    const Vec3 hidden = hide_beside(p.t, w, s);
    const Triangle hidden_face =
        placed_triangle(scene, select(pair.face >= 0, pair.face, splat(0)), pair.instance).triangle;
    place_in_face(hidden_face, s.point, s.y.b1, s.y.b2);
    Vec3 light = {pair.weight, pair.weight, pair.weight};
    LightSample links =
        no_light_sample(pair.face >= 0, pair.row >= 0, select(pair.row >= 0, pair.row, pair.face), s.y.kind);
    if (scatters) {
        links.blockers = splat(kScatteredRays);
    } else {
        light = light * light_of_intersection(scene, pair, s, w);
        if (any(pair.row >= 0)) {
            const Int row = select(pair.row >= 0, pair.row, splat(0));
            take_links(scene.lights, pair.row >= 0, row, gather(scene.lights.flags, row), links);
        }
        s.active &= links.casts_shadow;
    }
    const Int hider_mask = gather(scene.mesh_mask, mesh_of(scene, pair.hider));
    s.active &= ((hider_mask & links.blockers) != 0) & (largest_component(light) > 0.0f);
    if (!any(s.active)) return queued;
    light = light * stopped_by(scene, s.active, pair.hider, pair.hider_instance, s.point, w,
                               scatters ? kDiffuseRay : kShadowRay);

    Float probability;
    const Int length = chain_length(p, task.max_depth - (scatters ? 3 : 2), probability);
    s.slides = length == 0;
    const LightsWay way = {links.blockers, select(s.slides, splat(1 << kCameraRay), splat(kScatteredRays)),
                           scatters ? kDiffuseRay : kShadowRay, splat(0)};
    const LitPoint lit =
        find_receiver(scene, s.active, s.point, s.towards, {s.edge, s.instance}, way, p.random);
    s.active &= lit.found & (lit.hit.distance > 1e-5f * largest_component(s.point));
    if (!any(s.active)) return queued;
    s.reach = select(s.active, lit.hit.distance, 1.0f);
    s.active &= ~sees_other_side(scene, s, w);
    s.x = surface_point(scene, s.active, lit.hit.face, lit.hit.b1, lit.hit.b2, w,
                        select(s.active, lit.hit.instance, splat(-1)));
    s.x.mesh = lit.hit.mesh;
    s.active = s.x.active & shines_on(scene, s.y.row, s.x.mesh);
    if (!scatters)
        s.lambda = select(holds_direction(scene, s.active, pair.face, s.x.material), splat(1.0f), 0.0f);
    hold_contact(scene, length, s);
    const Int kinds = scatters ? splat(kScatteredRays) : links.visible_to;
    const SeenLight seen = see_light(scene, task, p, s.active, lit.hit, w, length, kinds, scatters, splat(0));
    s.active = seen.active;
    s.view = seen.view;
    if (scene.mesh_contact) s.held = seen.held;
    turn_to(s.x, -s.view.direction);
    s.color = seen.weight * lit.through * light *
              ((p.u1 - p.u0) * task.scale / (density * probability * p.density));
    if (!scatters || !any(s.active)) return queued;
    Closest y = lit.hit;
    y.face = pair.face, y.instance = pair.instance,
    y.mesh = mesh_of(scene, select(s.active, pair.face, splat(0)));
    y.b1 = s.y.b1, y.b2 = s.y.b2, y.distance = splat(0.0f);
    const Vec3 aside = leave_contact(scene, s.active, p.t, hidden, y);
    const Vec3 white = {splat(1.0f), splat(1.0f), splat(1.0f)};
    return append_scattering(work, queued, s.active, lane_index() + at, s.point, s.towards, y, aside, white,
                             splat(0), length + 2, seen.bounces, splat(static_cast<int>(kDiffuseRay)));
}

// The part of sweep . dq by the surface that hides; what is returned is the adjoint of the other's point.
template <typename Mode>
EG_INLINE Vec3 hider_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                            const IntersectionSegment& s, Vec3 color) {
    const IntersectingPair& pair = s.pair;
    Float mu, mu_y;
    part_normals(s.sweep, pair.hider_normal, pair.normal, mu, mu_y);
    plane_point_blocks(mode, scene, motion, s.active, pair.hider, pair.hider_instance, s.point,
                       pair.hider_normal * mu, color);
    return pair.normal * mu_y;
}

// Of lines through spheres, the part of q that the surface moves, along its normal, and that of y, which has
// a place of the cone in which x sees the sphere: what is returned is the adjoint of x by that.
template <typename Mode>
EG_INLINE Vec3 sphere_point_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                   Mask sphere, const IntersectionSegment& s, Vec3 by_normal, Vec3 by_y,
                                   Vec3 color) {
    if (motion.lights_requested) {
        const Int light = select(sphere, s.y.row, splat(0));
        Float row[kLightParams];
        for (Float& r : row) r = splat(0.0f);
        sphere_surface_row(scene.lights, sphere, light, s.point, by_normal, row);
        mode.light(sphere, light, row, color);
    }
    const Vec3 from =
        far_end_blocks(mode, scene, motion, sphere, s.y, s.x.position, s.towards, s.reach, by_y, color);
    return select(sphere, from, zero3());
}

// sweep . (dq - dy), times the color, for what `asked` names.
template <typename Mode>
EG_INLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                             const IntersectionSegment& s) {
    const IntersectingPair& pair = s.pair;
    const Vec3 color = select(s.slides, s.color * -dot(s.x.normal, s.view.across_of), s.color);
    const Vec3 by_normal = hider_blocks(mode, scene, motion, s, color);
    const Vec3 by_y = s.sweep * (s.lambda - 1.0f), g = by_normal + by_y;
    const Mask sphere = s.active & (s.y.kind == splat(static_cast<int>(kSphereLight)));
    const Vec3 from =
        any(sphere) ? sphere_point_blocks(mode, scene, motion, sphere, s, by_normal, by_y, color) : zero3();
    if (any(sphere | (s.active & (s.lambda > 0.0f))))
        lit_end_blocks(mode, scene, motion, s, from - s.sweep * s.lambda);
    const Mask on_face = s.active & (pair.face >= 0);
    if (any(on_face))
        plane_point_blocks(mode, scene, motion, on_face, pair.face, pair.instance, s.point, g, color);
    far_end_blocks(mode, scene, motion, s.active & ~sphere, s.y, s.point, s.towards, splat(0.0f), g, color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
