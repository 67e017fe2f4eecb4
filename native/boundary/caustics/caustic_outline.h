// Outlines of sized lights of the table in caustics (boundary/caustics/caustic_path.h).
//
// In the interior term x and m_1 are in material form (x in screen form, if the camera sees it), and the ray
// that leaves m_K, from p along D, is a function of both and of theta. Its radiance jumps where it passes the
// light's outline, g(p, D, theta) = 1 - rho = 0 (boundary/specular/mirrored_outline.h). Lines keep their
// measure along the chain (boundary/caustics/bent_light.h). So the integral over x and m_1 is taken over m_K
// and the outline as seen from there:
//   dI = int dA_m int dD delta(1 - rho) |n . D| (change of the measure) W(x) T L dg/dtheta.
// For flat lights dD delta(1 - rho) = dl |n_y . D| / (r^2 |q|) at the point y of the outline, q = grad rho in
// the light's plane; for cones of directions it is the azimuth times 1 - cos of the cone. Nothing is divided
// by a derivative of the chain, so that the cusps and folds of a caustic are like any other place.
//
// m_K is sampled by area, y on the outline. dp and dD are those of the recorded path.
#pragma once

#include "boundary/caustics/traced_beams.h"
#include "boundary/segment/silhouette.h"

namespace edgegrad::EDGEGRAD_ISA {

// The outline of a light as seen from m.
struct SeenOutline {
    Vec3 direction;  // unit, to a point of the outline
    Float measure;   // dD delta(1 - rho) per turn
};

// The integral of the outline's measure as seen from m, roughly; 0 where no ray from m meets the light.
EG_INLINE Float outline_size(const LightRow& l, int kind, Vec3 m) {
    const Vec3 way = l.position - m;
    const Float r2 = max(dot(way, way), 1e-30f);
    constexpr float kTurn = 6.2831853f;
    switch (kind) {
        case kSphereLight:
            return select(r2 > l.radius * l.radius, kTurn * sphere_cone(way, l.radius).cap, splat(0.0f));
        case kDiskLight:
            return kTurn * l.radius * l.radius / r2;
        case kRectangleLight:
        case kEllipseLight: {
            const Float area = sqrt(dot(l.axis_x, l.axis_x) * dot(l.axis_y, l.axis_y));
            const Float facing = max(-dot(way, l.direction), 0.0f);
            return (kind == kRectangleLight ? 8.0f : kTurn) * area * facing / (r2 * sqrt(r2));
        }
        default:
            return kTurn * l.one_minus_cos;
    }
}

// The outline at the fraction `turn` of its length.
EG_INLINE SeenOutline see_outline_of(const LightRow& l, int kind, Vec3 m, Float turn) {
    constexpr float kTurn = 6.2831853f;
    const Vec3 way = l.position - m;
    Float s, c;
    sincos_turn(turn, s, c);
    if (kind == kSphereLight || kind == kConeLight) {
        const SphereCone cone = sphere_cone(way, l.radius);
        const Vec3 axis = kind == kConeLight ? -l.direction : cone.axis;
        const Float cap = kind == kConeLight ? l.one_minus_cos : cone.cap;
        Vec3 a, b;
        basis(axis, a, b);
        const Float sine = sqrt(max(cap * (2.0f - cap), 0.0f));
        return {axis * (1.0f - cap) + (a * c + b * s) * sine, kTurn * cap};
    }
    Vec3 across, normal = l.direction;
    Float area;
    if (kind == kDiskLight) {
        normal = unit_vector(way);
        Vec3 a, b;
        basis(normal, a, b);
        across = (a * c + b * s) * l.radius;
        area = kTurn * l.radius * l.radius;
    } else {
        area = sqrt(dot(l.axis_x, l.axis_x) * dot(l.axis_y, l.axis_y));
        if (kind == kEllipseLight) {
            across = l.axis_x * c + l.axis_y * s;
            area = kTurn * area;
        } else {
            // Four sides in turn
            const Float place = 4.0f * turn, along = 2.0f * fract(place) - 1.0f;
            const Mask upright = (place >= 1.0f) & (place < 3.0f);
            const Float end = select(place >= 2.0f, splat(-1.0f), splat(1.0f));
            across = l.axis_x * select(upright, end, along) + l.axis_y * select(upright, along, end);
            area = 8.0f * area;
        }
    }
    const Vec3 to = way + across;
    const Float r2 = max(dot(to, to), 1e-30f), inverse = 1.0f / sqrt(r2);
    const Vec3 d = to * inverse;
    return {d, area * abs(dot(normal, d)) / r2};
}

// Chooses one of the sized lights by the size of its outline as seen from m. Returns its row, or -1.
EG_OUTLINE Int choose_outline(const SceneView& scene, Mask active, Vec3 m, Float u, Float turn,
                              SeenOutline& seen, Float& probability) {
    const LightView& lights = scene.lights;
    const int count = lights.all_sized();
    const auto size = [&](int k) EG_INLINE_LAMBDA {
        const int row = lights.sized[k];
        const LightRow l = gather_light(lights, splat(row));
        if (!(lights.visible_to[row] & kBentRays)) return splat(0.0f);
        return outline_size(l, lights.kind[lights.light_of_row[row]], m) * abs(average(l.radiance));
    };
    Float sum = splat(0.0f);
    for (int k = 0; k < count; ++k) sum = sum + size(k);
    Int chosen = splat(-1);
    Float mark = u * sum;
    seen = {zero3(), splat(0.0f)};
    probability = splat(1.0f);
    Mask left = active & (sum > 0.0f);
    for (int k = 0; k < count && any(left); ++k) {
        const Float here = size(k);
        const Mask picked = left & (here > 0.0f) & ((mark < here) | (k == count - 1 ? splat(-1) : splat(0)));
        mark = mark - here;
        if (!any(picked)) continue;
        const int row = lights.sized[k];
        const SeenOutline o =
            see_outline_of(gather_light(lights, splat(row)), lights.kind[lights.light_of_row[row]], m, turn);
        chosen = select(picked, splat(row), chosen);
        seen.direction = select(picked, o.direction, seen.direction);
        seen.measure = select(picked, o.measure, seen.measure);
        probability = select(picked, here / max(sum, 1e-30f), probability);
        left &= ~picked;
    }
    return chosen;
}

// Samples the outlines of lights behind chains. Returns the number of stored paths.
EG_OUTLINE int sample_caustic_outlines(const SceneView& scene, const BoundaryTask& task,
                                       ChainCrossings& out) {
    SegmentCursor cursor = first_segment(task);
    int found = 0;
    for (int64_t at = 0; at < task.count; at += W) {
        const SegmentSample p = sample_entry(task, at, cursor);
        Float u, v;
        const float cells = cell_numbers(task, p, u, v);
        const Float pick = sobol_pair(p.random, kPairLight).u;
        Triangle t;
        const Closest m = mirror_point(scene, p, u, v, t);
        SeenOutline outline;
        Float probability;
        const Int row = choose_outline(scene, p.active, interpolate(t, m.b1, m.b2), pick,
                                       p.u0 + (p.u1 - p.u0) * p.tau, outline, probability);
        const Mask active = p.active & (row >= 0) & (outline.measure > 0.0f);
        if (!any(active)) continue;
        // |n . D| dA_m, by the area of the parallelogram
        const Float area = 0.5f * abs(dot(area_normal(t), outline.direction));
        const Float weight =
            (p.u1 - p.u0) * outline.measure * area / (cells * p.density * max(probability, 1e-30f));
        found = follow_caustic(
            scene, task, p, active, m, outline.direction, gray(weight), at, out, found,
            [&](int i, const BentLight& light, int length) EG_INLINE_LAMBDA {
                const int kind = light.event[0][i] & kEventTransmits ? kTransmissionRay : kGlossyRay;
                return shines_along(scene, row[i], light.mesh[0][i], kind, length + light.count[i]);
            },
            [&](int i, int n) EG_INLINE_LAMBDA { out.outlined_light[n] = row[i]; });
    }
    return found;
}

}  // namespace edgegrad::EDGEGRAD_ISA
