// Intersections of surfaces: a surface occludes a part of another that it passes through and that emits or
// scatters light.
//
// The line along which a surface i intersects another surface j, or a light, bounds the part of j that a
// point x sees. This is formula (S) of the derivations (boundary/segment/segment.h) with the line in place of
// an edge and y on the line. Then lambda = 0, so that x's motion drops out (derivations, F2):
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (dq - dy),
// where q is the line's point at u and x the first surface along w. y moves with j, and q lies on both
// planes. With g = sigma (t x w) = mu_i n_i + mu_j n_j
//   g . dq = mu_i n_i . m_i(q) + mu_j n_j . m_j(q)     (boundary/samples/intersection_point.h).
// The part of j that is occluded from x lies on the side of i's plane away from x: sigma = sign((t x w) . h),
// with h in j perpendicular to the line and (n_i . h)(n_i . w) < 0. L(y) is the emission of j (shadow term),
// or the radiance that j scatters, estimated by a path of the picture (indirect term).
//
// Light of a fixed direction (shading/lights/fixed_direction_light.h) has lambda = 1, so that dx takes the
// place of dy. Near contact it does so with the blending weight (scene/contact.h). For a sphere n_j is its
// normal at q. Its y is fixed in the cone in which x sees the sphere, so dx contributes. Disks face x, and
// their lines depend on x: see boundary/terms/disk_intersection.h.
//
// Where a field is one of the surfaces, the line is a curve (boundary/samples/crossing_samples.h), and a
// field moves along its normal.
//
// u is uniform on the sampled segment, and w uniform in the sample's cell of the sphere of directions.
#pragma once

#include "boundary/samples/crossing_samples.h"
#include "boundary/samples/light_cut.h"
#include "boundary/segment/far_radiance.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/silhouette.h"
#include "shading/lights/light_radiance.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// The two surfaces of a line: the one that occludes (hider), and the one that is occluded.
struct IntersectingPair {
    Int hider, face;               // face -1: a light
    Int hider_instance, instance;  // placing the faces
    Int row;                       // of the light table; -1: a face
    Vec3 hider_normal, normal;
    Float weight;  // 1 over the probability of the choice
    Mask second;   // the occluded surface is the line's second one
};

struct IntersectionSegment : BoundarySegment {
    IntersectingPair pair;
};

// Chooses which of the two surfaces is the occluded one. In the shadow term it must emit light.
EG_INLINE IntersectingPair pick_intersection(const SceneView& scene, const BoundaryTask& task,
                                             const SegmentSample& p) {
    IntersectingPair pair;
    const Float choice = sobol_pair(p.random, kPairLight).u;
    pair.row = splat(-1);
    pair.second = splat(0);
    for (int i = 0; i < W; ++i) {
        const LineSurface surfaces[2] = {scene.surface_of_line(p.edge[i], 0),
                                         scene.surface_of_line(p.edge[i], 1)};
        // The light of a line is second. Lights of the table are occluded but never occlude.
        bool counts[2] = {false, true};
        for (int k = 0; k < 2; ++k)
            if (!surfaces[0].is_light() && !surfaces[1].is_light())
                counts[k] = scatters_at_lines(task.kind) ||
                            (scene.lights.face_light && scene.lights.face_light[surfaces[k].face()] >= 0);
        const int k = counts[0] && (!counts[1] || choice[i] < 0.5f) ? 0 : 1;
        pair.second[i] = k == 1 ? -1 : 0;
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

// Samples a direction about the line, uniformly in the sample's direction cell.
EG_INLINE Vec3 direction_about(const BoundaryTask& task, const SegmentSample& p, Float& density) {
    Float u, v;
    density = splat(kInvFourPi * cell_numbers(task, p, u, v));
    const Vec3 axis = unit_vector(p.t);
    Vec3 a, b;
    basis(axis, a, b);
    Float s, c;
    sincos_turn(min(v, splat(0.99999994f)), s, c);
    const Float along = 2.0f * u - 1.0f, across = sqrt(max(1.0f - along * along, 0.0f));
    return axis * along + (a * c + b * s) * across;
}

// For lines through lights of the table: moves the point onto the light, and sets its normal and, in `p`, the
// line's tangent there.
EG_INLINE void cut_light_row(const SceneView& scene, IntersectionSegment& s, SegmentSample& p) {
    const Mask on_row = s.active & (s.pair.row >= 0);
    if (!any(on_row)) return;
    const LightRow l = gather_light(scene.lights, select(on_row, s.pair.row, splat(0)));
    const LightCut cut = light_cut(l, s.y.kind, s.point, p.t, s.pair.hider_normal);
    s.point = select(on_row, cut.point, s.point);
    p.t = select(on_row, cut.tangent, p.t);
    s.pair.normal = select(on_row, cut.normal, s.pair.normal);
}

// Spheres emit outwards to points outside, and inwards to points inside. Lanes in which x, at s.reach from y,
// is on the other side.
EG_INLINE Mask sees_other_side(const SceneView& scene, const IntersectionSegment& s, Vec3 w) {
    const Mask round = s.active & (s.y.kind == splat(kSphereLight));
    if (!any(round)) return round;
    const LightRow l = gather_light(scene.lights, select(round, s.pair.row, splat(0)));
    // Inwards, x is inside up to the far end of the chord.
    const Float outwards = dot(s.pair.normal, w);
    return round & (outwards < 0.0f) & (s.reach >= -2.0f * l.radius * outwards);
}

// The emission of y along w.
EG_INLINE Vec3 light_of_intersection(const SceneView& scene, const IntersectingPair& pair,
                                     const BoundarySegment& s, Vec3 w) {
    const Mask on_row = s.active & (pair.row >= 0), on_face = s.active & ~on_row;
    Vec3 light = zero3();
    if (any(on_row)) {
        const LightRow l = gather_light(scene.lights, select(on_row, pair.row, splat(0)));
        const Mask round = s.y.kind == splat(kSphereLight);
        const Mask shines = on_row & (round | (dot(w, l.direction) > 0.0f));
        light = select(shines, l.radiance * light_factor(l, -w), light);
    }
    if (any(on_face)) {
        const SurfacePoint y = surface_point(scene, on_face, select(on_face, pair.face, splat(0)), s.y.b1,
                                             s.y.b2, -w, select(on_face, pair.instance, splat(-1)));
        const TexturePoint point = texture_point(scene, y, w, splat(kNoRay));
        light = select(on_face, emitted_radiance(scene, y, point), light);
    }
    return light;
}

// Sets the sweep of the segment along w. Occluded is the part of the surface behind the hider's plane.
// Returns the direction, in the surface, that points to this part.
EG_INLINE Vec3 hide_beside(Vec3 t, Vec3 w, IntersectionSegment& s) {
    const Vec3 across = cross(t, w);
    const Float facing = dot(s.pair.hider_normal, w);
    Vec3 hidden = cross(s.pair.normal, t);
    hidden = select(dot(s.pair.hider_normal, hidden) * facing > 0.0f, -hidden, hidden);
    s.sweep = select(dot(across, hidden) < 0.0f, -across, across);
    s.active &= (facing != 0.0f) & (dot(s.pair.normal, w) != 0.0f);
    return hidden;
}

// For lines on fields: moves the point onto the curve, and sets the normals there and, in `p`, the tangent.
EG_INLINE void bend_to_fields(const SceneView& scene, IntersectionSegment& s, SegmentSample& p,
                              CrossingSample& curve) {
    place_on_crossings(scene, s.active, s.edge, s.u, curve);
    s.point = select(s.active, curve.position, s.point);
    p.t = select(s.active, curve.tangent, p.t);
    const CrossedSide &one = curve.side[0], &other = curve.side[1];
    IntersectingPair& pair = s.pair;
    pair.normal = select(pair.second, other.normal, one.normal);
    pair.hider_normal = select(pair.second, one.normal, other.normal);
    s.y.b1 = select(pair.second, other.b1, one.b1);
    s.y.b2 = select(pair.second, other.b2, one.b2);
}

// Drops samples whose segment meets another part of its fields shortly before y. Returns the length over
// which that is known, behind which rays start. Where the curve runs back, samples count negatively.
EG_INLINE Float leave_fields(const SceneView& scene, IntersectionSegment& s, const CrossingSample& curve) {
    Float contact[2];
    s.active = reached_first(scene, s.active, curve, s.towards, contact);
    s.sweep = select(curve.reversed, -s.sweep, s.sweep);
    return max(contact[0], contact[1]);
}

// The step from the curve to the part of y's surface that the hider does not occlude.
EG_INLINE Vec3 step_from_hider(const SceneView& scene, const IntersectionSegment& s,
                               const CrossingSample& curve, Vec3 t, Vec3 hidden) {
    CrossedSide side = curve.side[0];
    side.normal = s.pair.normal;
    return step_beside(side, t, -hidden, step_length(scene, s.active, curve));
}

// Samples a segment, without the light that y scatters. Appends the path that estimates it to the queue, and
// returns the new length.
EG_OUTLINE int sample_intersection(const SceneView& scene, const BoundaryTask& task,
                                   const DerivativeView& motion, int at, SegmentCursor& cursor,
                                   Workspace& work, int queued, IntersectionSegment& s) {
    // Sample a point of the line and choose the occluded surface
    SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    const bool scatters = scatters_at_lines(task.kind), bent = crosses_fields(task.kind);
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
    CrossingSample curve;
    if (bent) bend_to_fields(scene, s, p, curve);
    // Skip samples that do not move
    Mask moves = face_point_moves(scene, motion, s.active, pair.hider, pair.hider_instance) |
                 face_point_moves(scene, motion, s.active & (pair.face >= 0), pair.face, pair.instance);
    if (motion.lights_requested) moves |= s.active & (pair.row >= 0);
    // x may move relative to y.
    if (scene.mesh_contact || (!scatters && scene.face_fixed_direction)) moves = s.active;
    moves |= s.active & (pair.row >= 0) & turns_with_point(s.y.kind);
    s.active &= moves;
    if (!any(s.active)) return queued;

    // Sample a direction and evaluate the light
    Float density;
    const Vec3 w = direction_about(task, p, density);
    s.towards = -w;
    const Vec3 hidden = hide_beside(p.t, w, s);
    Float gap = splat(0.0f);
    if (bent) {
        gap = leave_fields(scene, s, curve);
    } else {
        const Triangle hidden_face =
            placed_triangle(scene, select(pair.face >= 0, pair.face, splat(0)), pair.instance).triangle;
        place_in_face(hidden_face, s.point, s.y.b1, s.y.b2);
    }
    Vec3 light = {pair.weight, pair.weight, pair.weight};
    LightSample links = no_light_sample(scene, pair.face >= 0, pair.row >= 0,
                                        select(pair.row >= 0, pair.row, pair.face), s.y.kind);
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
    light = light * stopped_by(scene, s.active, select(s.active, pair.hider, splat(0)), pair.hider_instance,
                               s.point, w, scatters ? kDiffuseRay : kShadowRay);

    // Find the receiver
    Float probability;
    const Int length = chain_length(p, task.max_depth - (scatters ? 3 : 2), probability);
    s.screen_form = length == 0;
    const ReceiverRays rays =
        receiver_rays(links.blockers, s.screen_form, scatters ? kDiffuseRay : kShadowRay);
    const ReceiverHit receiver =
        find_receiver(scene, s.active, s.point + w * gap, s.towards, {s.edge, s.instance}, rays, p.random);
    s.active &= receiver.found & (receiver.hit.distance > 1e-5f * largest_component(s.point));
    if (!any(s.active)) return queued;
    s.reach = select(s.active, receiver.hit.distance + gap, 1.0f);
    s.active &= ~sees_other_side(scene, s, w);
    s.x = hit_surface(scene, s.active, receiver.hit, w);
    s.active = s.x.active & shines_on(scene, s.y.row, s.x.mesh, length);
    if (!scatters)
        s.lambda = select(holds_direction(scene, s.active, pair.face, s.x.material), splat(1.0f), 0.0f);
    blend_near_contact(scene, length, s);
    // Follow the light to the camera
    const Int kinds = scatters ? splat(kScatteredRays) : links.visible_to;
    const SeenLight seen = see_light(scene, task, p, s.active, receiver.hit, w, length, kinds, scatters,
                                     splat(0), splat(scene.followed_alpha));
    take_view(scene, seen, s);
    light = light * decay_along(scene, s);
    s.color = seen.weight * receiver.through * light *
              ((p.u1 - p.u0) * task.scale / (density * probability * p.density));
    // Queue the path of the light that y scatters
    if (!scatters || !any(s.active)) return queued;
    Closest y = receiver.hit;
    y.face = pair.face, y.instance = pair.instance,
    y.mesh = mesh_of(scene, select(s.active, pair.face, splat(0)));
    y.b1 = s.y.b1, y.b2 = s.y.b2, y.distance = splat(0.0f);
    const Vec3 aside =
        bent ? step_from_hider(scene, s, curve, p.t, hidden) : leave_contact(scene, s.active, p.t, hidden, y);
    const Vec3 kept = kept_before_start(scene, s.active, y, s.point, s.towards, s.reach);
    return append_scattering(work, queued, s.active, lane_index() + at, s.point, s.towards, y, aside, kept,
                             splat(0), length + 2, seen.bounces, splat(kDiffuseRay));
}

// Adds the hider's part of sweep . dq. Returns the adjoint of the other surface's point.
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

// For lines through spheres: adds the motion of q with the sphere's surface, along its normal, and that of y
// in the cone in which x sees the sphere. Returns the adjoint of x, on which the cone depends.
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

// Adds sweep . (dq - dy), times the color, for the requested parameters.
template <typename Mode>
EG_INLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                             const IntersectionSegment& s) {
    const IntersectingPair& pair = s.pair;
    const Vec3 color = select(s.screen_form, s.color * -dot(s.x.normal, s.view.across_of), s.color);
    const Vec3 by_normal = hider_blocks(mode, scene, motion, s, color);
    const Vec3 by_y = s.sweep * (s.lambda - 1.0f), g = by_normal + by_y;
    const Mask sphere = s.active & (s.y.kind == splat(kSphereLight));
    const Vec3 from =
        any(sphere) ? sphere_point_blocks(mode, scene, motion, sphere, s, by_normal, by_y, color) : zero3();
    if (any(sphere | (s.active & (s.lambda > 0.0f))))
        receiver_blocks(mode, scene, motion, s, from - s.sweep * s.lambda);
    const Mask on_face = s.active & (pair.face >= 0);
    if (any(on_face))
        plane_point_blocks(mode, scene, motion, on_face, pair.face, pair.instance, s.point, g, color);
    far_end_blocks(mode, scene, motion, s.active & ~sphere, s.y, s.point, s.towards, splat(0.0f), g, color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
