// The border of a spot's cone without blend, where the spot's light is discontinuous (derivations, D).
//
// Light leaves a point y of the spot along a direction o, at the angle theta to the axis a, and reaches x at
// the distance r. The cone ends at theta = c. With N = do/dtheta, the border's angular velocity across the
// segment from y to x is dc + o . da/sin(c) - N . (dx - dy)/r: the first two parts turn the border, and the
// last part turns the segment. Hence
//   dI = int dA int dphi sin(c)  W(x) L [dc + o . da/sin(c) - N . (dx - dy)/r],
// where phi is the angle about the axis and A the light's area perpendicular to o. For spots without size,
// L dA is the intensity. W(x) is the importance (boundary/segment/scattering_chain.h). One side of the border
// is dark, so the jump is L.
//
// phi is sampled uniformly in the range of the sample's segment, and the point of the light uniformly in its
// disk.
#pragma once

#include "boundary/segment/receiver.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/segment.h"
#include "shading/lights/light_samples.h"
#include "tasks/boundary_task.h"
#include "tasks/splats.h"

namespace edgegrad::EDGEGRAD_ISA {

struct ConeSample : BoundarySegment {  // `sweep` is N/r
    Float axis, angle;                 // factors on o . da, and on the change of the row's kLightEdge
};

EG_OUTLINE ConeSample sample_cone_border(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                         SegmentCursor& cursor, const DerivativeView& motion, const float*) {
    constexpr float kTurn = 6.28318531f;
    ConeSample out;
    BoundarySegment& s = out;
    const SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    const Int row = p.light_row();
    s.active = p.active;
    s.edge = s.instance = splat(-1);
    s.y = still_far_end();
    s.y.row = row;
    s.y.kind = kind_of_rows(scene.lights, row);
    s.view.sx = s.view.sy = splat(kNowhere);
    const LightRow l = gather_light(scene.lights, row);

    // Sample the direction on the border and the point of the light.
    const Mask linear = (l.flags & static_cast<int>(kLightLinearCone)) != 0;
    Float sine, cosine, s_phi, c_phi;
    sincos(l.edge, sine, cosine);
    cosine = select(linear, cosine, 1.0f - l.edge);
    sine = select(linear, sine, sqrt(max(l.edge * (2.0f - l.edge), 0.0f)));
    sincos_turn(min(p.u0 + (p.u1 - p.u0) * p.tau, splat(0.99999994f)), s_phi, c_phi);
    Vec3 a, b;
    basis(l.direction, a, b);
    const Vec3 out_of_axis = a * c_phi + b * s_phi;
    const Vec3 o = l.direction * cosine + out_of_axis * sine;
    const Vec3 normal = out_of_axis * cosine - l.direction * sine;
    Float area = splat(1.0f);
    s.point = l.position;
    const Mask sphere = s.y.kind == splat(kSphereLight);
    const Mask sized = sphere | (s.y.kind == splat(kDiskLight));
    if (any(sized)) {
        const auto [u, v] = sobol_pair(p.random, kPairLight);
        Float x, y;
        sample_disk(u, v, x, y);
        basis(o, a, b);
        const Float rise = sqrt(max(1.0f - x * x - y * y, 0.0f));
        const Vec3 offset = a * x + b * y + o * select(sphere, rise, splat(0.0f));
        s.point = select(sized, s.point + offset * l.radius, s.point);
        area = select(sized, l.radius * l.radius * 3.14159265f, area);
    }
    s.towards = -o;
    out.axis = 1.0f / max(sine, 1e-6f);
    out.angle = select(linear, splat(1.0f), out.axis);

    // Find the receiver.
    LightSample links = no_light_sample(scene, splat(0), s.active, row, s.y.kind);
    take_links(scene.lights, s.active, row, l.flags, links);
    Float probability;
    const Int length = chain_length(p, task.max_depth - 2, probability);
    s.screen_form = length == 0;
    const ReceiverRays rays =
        receiver_rays(select(links.casts_shadow, links.blockers, splat(0)), s.screen_form, kShadowRay);
    const ReceiverHit receiver =
        find_receiver(scene, s.active, s.point, s.towards, ignore_nothing(), rays, p.random);
    s.active &= receiver.found & (receiver.hit.distance > 0.0f);
    if (!any(s.active)) return out;
    s.reach = select(s.active, receiver.hit.distance, 1.0f);
    s.distance = splat(0.0f);
    s.x = hit_surface(scene, s.active, receiver.hit, o);
    s.active = s.x.active & shines_on(scene, row, s.x.mesh, length);
    const Mask disk = s.active & sized & ~sphere;
    if (any(disk)) {
        // A disk faces x: move y to where the segment meets it.
        Float pdf;
        const Float way_to_disk = meet_light(l, kDiskLight, s.x.position, s.towards, pdf);
        s.reach = select(disk, way_to_disk, s.reach);
        s.active &= ~disk | (s.reach > 0.0f);
    }
    // Skip samples that do not move
    Mask moves = receiver_moves(scene, motion, s.active, s.x, s.screen_form);
    if (motion.lights_requested) moves |= s.active;
    s.active &= moves;
    if (!any(s.active)) return out;
    s.sweep = normal * (1.0f / max(s.reach, 1e-30f));
    // Follow the light to the camera
    const SeenLight seen = see_light(scene, task, p, s.active, receiver.hit, o, length, links.visible_to,
                                     false, splat(0), splat(0.0f));
    take_view(scene, seen, s);
    s.color = seen.weight * receiver.through * l.radiance * distance_factor(l, s.reach) *
              (area * sine * (p.u1 - p.u0) * (kTurn * task.scale) / (p.density * probability));
    s.active &= largest_component(s.color) > 0.0f;
    return out;
}

// Adds dc + o . da/sin(c) - N . (dx - dy)/r, times the color, for the requested parameters.
template <typename Mode>
EG_INLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                             const ConeSample& s) {
    const Vec3 color = select(s.screen_form, s.color * -dot(s.x.normal, s.view.across_of), s.color);
    if (motion.lights_requested) {
        Float row[kLightParams];
        for (Float& r : row) r = splat(0.0f);
        row[kLightEdge] = s.angle;
        row[kLightDirection] = -s.towards.x * s.axis;
        row[kLightDirection + 1] = -s.towards.y * s.axis;
        row[kLightDirection + 2] = -s.towards.z * s.axis;
        mode.light(s.active, select(s.active, s.y.row, splat(0)), row, color);
    }
    const Vec3 from =
        far_end_blocks(mode, scene, motion, s.active, s.y, s.x.position, s.towards, s.reach, s.sweep, color);
    receiver_blocks(mode, scene, motion, s, from - s.sweep);
}

}  // namespace edgegrad::EDGEGRAD_ISA
