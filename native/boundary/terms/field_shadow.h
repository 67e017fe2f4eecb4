// Shadow boundary term of distance fields: a field between a receiver and its light.
//
// Formula (S) of the derivations (boundary/segment/segment.h), with the field's normal n in the place of
// t x w. A surface that moves along n takes light away, so that for a change dphi of the field with the
// gradient g
//   dI = - int W(x) L(y) n . (de - lambda dx - (1 - lambda) dy) dm,    n . de = -dphi / |g|.
// - Lights without size see the field's outline. As for edges, dm = |t x w| du along it, and L is I/|e - y|^2
//   or a sun's irradiance.
// - For all other light, e is a point of the surface and the line a tangent there: dm = kappa_n dA dpsi
//   (boundary/segment/touched_field.h). For lights, psi is uniform in the angle under which the tangent plane
//   meets the chosen light. For the environment its density is proportional to kappa_n.
#pragma once

#include "boundary/fields/field_viewer.h"
#include "boundary/samples/intersection_point.h"
#include "boundary/segment/shadow_connection.h"
#include "boundary/segment/tangents_to_lights.h"
#include "boundary/segment/touched_field.h"
#include "shading/lights/light_radiance.h"
#include "tasks/boundary_kind.h"

namespace edgegrad::EDGEGRAD_ISA {

// Light of one row of the table or of one emissive face, which a segment meets.
struct MetLight {
    LightSample& sample;  // what is known of the light; its radiance is set
    // The part of its light that the field stops, over the density of the choice of light and direction
    Vec3 weight;

    EG_INLINE Int blockers() const { return sample.blockers; }
    EG_INLINE Int visible_to(const SceneView&, const BoundaryTask&) const { return sample.visible_to; }

    // Sets y to where the line from x through e meets the light.
    EG_INLINE void meet(const SceneView& scene, BoundarySegment& s) const {
        const Mask on_row = s.active & (s.y.row >= 0), on_face = s.active & (s.y.face >= 0);
        if (any(on_row)) {
            const LightRow l = gather_light(scene.lights, select(on_row, s.y.row, splat(0)));
            Float way = s.distance + s.reach;
            for (const LightKind kind :
                 {kSphereLight, kDiskLight, kRectangleLight, kEllipseLight, kConeLight}) {
                const Mask here = on_row & (s.y.kind == splat(kind));
                Float unused;
                if (any(here)) way = select(here, meet_light(l, kind, s.x.position, s.towards, unused), way);
            }
            s.distance = select(on_row, way - s.reach, s.distance);
            s.active &= ~on_row | (s.distance > 0.0f);
        }
        if (any(on_face)) {
            const Int face = select(on_face, s.y.face, splat(0));
            const Triangle t = gather_triangle(scene, face);
            const Vec3 m = area_normal(t);
            const Float facing = dot(m, s.towards);
            const Float way = dot(m, t.p0 - s.point) / select(facing != 0.0f, facing, 1.0f);
            Float b1, b2;
            place_in_face(t, s.point + s.towards * way, b1, b2);
            s.y.b1 = select(on_face, b1, s.y.b1), s.y.b2 = select(on_face, b2, s.y.b2);
            s.distance = select(on_face, way, s.distance);
            s.active &= ~on_face |
                        ((facing != 0.0f) & (way > 0.0f) & (b1 >= 0.0f) & (b2 >= 0.0f) & (b1 + b2 <= 1.0f));
        }
    }

    EG_INLINE Vec3 arriving(const SceneView& scene, const BoundaryTask&, const SegmentSample&,
                            const CurveExit& exit, const BoundarySegment& s) const {
        const Mask on_face = s.active & (s.y.face >= 0), on_row = s.active & (s.y.row >= 0);
        sample.active = s.active;
        sample.w = s.towards;
        sample.b1 = s.y.b1, sample.b2 = s.y.b2;
        Vec3 lift = zero3();
        if (any(on_row)) {
            const LightRow l = gather_light(scene.lights, select(on_row, s.y.row, splat(0)));
            sample.radiance = select(on_row, l.radiance * light_factor(l, s.towards), sample.radiance);
        }
        if (any(on_face)) {
            const Int face = select(on_face, s.y.face, splat(0)),
                      material = gather(scene.face_material, face);
            const Triangle t = gather_triangle(scene, face);
            const Vec3 m = area_normal(t);
            const Mask front = dot(m, s.towards) < 0.0f;
            const Mask shines = on_face & (front | (gather(scene.emission_two_sided, material) != 0));
            sample.radiance = select(on_face, zero3(), sample.radiance);
            sample.radiance = select(shines, gather3(scene.emission, material), sample.radiance);
            sample.active &= ~on_face | shines;
            const Float step = ray_offset(t) / max(sqrt(dot(m, m)), 1e-30f);
            lift = select(on_face, m * select(front, step, -step), lift);
        }
        look_up_emission(scene, sample);
        // Trace from where the ray no longer touches the field
        const Mask near = s.distance < __builtin_inff();
        const Vec3 end = s.point + s.towards * select(near, s.distance, 1.0f) + lift;
        const Vec3 way = select(near, end - exit.before, s.towards);
        const Float far = select(near, splat(0.99999f), splat(__builtin_inff()));
        return sample.radiance * weight *
               transmittance(scene, s.active, exit.before, way, far, {sample.blockers});
    }
};

// The same for the environment.
struct MetEnvironment {
    Vec3 weight;
    Int rays;

    EG_INLINE Int blockers() const { return rays; }
    EG_INLINE Int visible_to(const SceneView& scene, const BoundaryTask&) const {
        return splat(scene.environment_mask);
    }
    EG_INLINE void meet(const SceneView&, BoundarySegment&) const {}
    EG_INLINE Vec3 arriving(const SceneView& scene, const BoundaryTask&, const SegmentSample&,
                            const CurveExit& exit, const BoundarySegment& s) const {
        return environment_radiance(scene, s.towards) * weight *
               transmittance(scene, s.active, exit.before, s.towards, splat(__builtin_inff()), {rays});
    }
};

// The part of the light that the field of each sample stops.
EG_INLINE Vec3 stopped(const SceneView& scene, const BoundarySegment& s, Vec3 normal) {
    return stopped_by_field(scene, s.active, field_of_line(scene, s.active, s.edge), s.point, normal,
                            s.towards, kShadowRay);
}

// Samples segments from lights without size through the outlines that these see. A line lists its light
// beside its field.
EG_OUTLINE BoundarySegment sample_field_outline_shadow(const SceneView& scene, const BoundaryTask& task,
                                                       int64_t at, SegmentCursor& cursor,
                                                       const DerivativeView& requested,
                                                       const float* adjoint) {
    BoundarySegment s;
    const SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    begin_segment(p, s);
    // Find the point of the outline
    Int row = splat(0);
    for (int i = 0; i < W; ++i)
        if (s.active[i]) row[i] = scene.surface_of_line(s.edge[i], 1).light_row();
    Vec3 tangent = zero3(), normal = tangent;
    Float contact = splat(0.0f), sign = splat(1.0f);
    for_each_outline_point(
        scene, s.active, s.edge, s.u,
        [&](int i, const FieldView& field) { return light_viewer(field, scene.lights, row[i]); },
        [&](int i, const FieldView&, const OutlinePoint& o) {
            set_lane3(s.point, i, o.position);
            set_lane3(tangent, i, o.tangent);
            set_lane3(normal, i, o.normal);
            contact[i] = o.contact;
            sign[i] = o.reversed ? -1.0f : 1.0f;
        });
    // Find the light
    const LightRow l = gather_light(scene.lights, row);
    s.y.row = select(s.active, row, splat(-1));
    s.y.kind = kind_of_rows(scene.lights, s.y.row);
    const Mask distant = is_distant(s.y);
    const Vec3 way = l.position - s.point;
    const Float r2 = max(dot(way, way), 1e-37f);
    s.towards = select(distant, -l.direction, way * (1.0f / sqrt(r2)));
    s.distance = select(distant, splat(__builtin_inff()), sqrt(r2));
    LightSample light = no_light_sample(scene, splat(0), s.active, row, s.y.kind);
    light.radiance = zero3();
    take_links(scene.lights, s.active, row, l.flags, light);
    s.active &= light.casts_shadow & meets_field(scene, s, light.blockers);
    if (!any(s.active)) return s;
    const Vec3 across = cross(tangent, s.towards);
    s.sweep = -normal * sqrt(dot(across, across));
    connect_shadow(scene, task, p, exit_of_field(s, normal, contact), requested, adjoint,
                   sign * (p.u1 - p.u0) / p.density,
                   MetLight{light, stopped(scene, s, normal) * select(distant, splat(1.0f), 1.0f / r2)}, s);
    return s;
}

// A point that surfaces on all sides may see, as the receiver of light.
struct OpenPoint {
    Vec3 position;
    EG_INLINE Float facing(Vec3) const { return splat(1.0f); }
};

// Samples tangents of the field towards lights with a size, or towards the environment.
EG_OUTLINE BoundarySegment sample_field_tangent_shadow(const SceneView& scene, const BoundaryTask& task,
                                                       int64_t at, SegmentCursor& cursor,
                                                       const DerivativeView& requested,
                                                       const float* adjoint) {
    BoundarySegment s;
    TouchingLine line;
    Float turn;
    const SegmentSample p = begin_on_field(scene, task, at, cursor, line, turn, s);
    if (task.kind == kFieldEnvironment) {
        const Int rays = environment_blockers(scene);
        s.active &= meets_field(scene, s, rays);
        if (!any(s.active)) return s;
        touch_by_curvature(scene, turn, line, s);
        s.distance = splat(__builtin_inff());
        s.y.environment = turns_with_environment(scene);
        if (any(s.active))
            connect_shadow(scene, task, p, line.exit, requested, adjoint, line.measure,
                           MetEnvironment{stopped(scene, s, line.at.normal), rays}, s);
        return s;
    }
    // Choose a light
    const auto [u, v] = sobol_pair(p.random, kPairLight);
    const LightChoice choice = choose_light(scene.lights, s.active, OpenPoint{s.point}, u);
    const Int kind = gather(scene.lights.kind, choice.light),
              index = gather(scene.lights.index, choice.light);
    const Mask on_face = choice.active & (kind == splat(kTriangleLight));
    const Mask on_row =
        choice.active & ~on_face & (kind != splat(kPointSource)) & (kind != splat(kDirectionLight));
    LightSample light = no_light_sample(scene, on_face, on_row, index, kind);
    light.active = on_face | on_row;
    if (any(on_row)) {
        const Int row = select(on_row, index, splat(0));
        take_links(scene.lights, on_row, row, gather(scene.lights.flags, row), light);
    }
    s.active &= light.active & light.casts_shadow & meets_field(scene, s, light.blockers);
    s.y.face = light.face, s.y.row = light.row, s.y.kind = kind;
    // Choose a tangent towards it
    Float angle;
    const Vec3 towards = tangent_to_light(scene, light, s.point, line.at.normal, v, angle);
    s.active &= angle > 0.0f;
    if (!any(s.active)) return s;
    line.measure = line.measure * touch(scene, towards, line, s);
    s.distance = select(s.y.kind == splat(kConeLight), splat(__builtin_inff()), splat(0.0f));
    if (any(s.active))
        connect_shadow(scene, task, p, line.exit, requested, adjoint, line.measure,
                       MetLight{light, stopped(scene, s, line.at.normal) * (angle / choice.probability)}, s);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
