// Segments that touch distance fields: by the outline of a field as a light without size sees it, or by
// tangents of its surface.
//
// The lines that touch a smooth surface have the measure dA dw = kappa_n dA dpsi, where the surface has the
// area A, psi is the angle of the line in the tangent plane, and kappa_n = w . H w / |g| the normal curvature
// along it (H = grad g; derivations, R). Only lines with kappa_n > 0 stay outside beside the point. Those
// with kappa_n < 0 stay inside, which counts where light travels there: the inside is then the side of the
// normal, and the curvature -kappa_n.
#pragma once

#include "boundary/samples/field_patches.h"
#include "boundary/samples/intersection_point.h"
#include "boundary/segment/segment.h"
#include "boundary/segment/silhouette.h"

namespace edgegrad::EDGEGRAD_ISA {

// Rays that pass the point e of a field start where they no longer touch the surface, slightly above it.
EG_INLINE CurveExit exit_of_field(const BoundarySegment& s, Vec3 normal, Float contact) {
    const Vec3 above = s.point + normal * (4e-6f * largest_component(s.point));
    return {above + s.towards * contact, above - s.towards * contact, contact, ignore_nothing()};
}

// Whether rays that have a bit of `mask` meet the field of each sample.
EG_INLINE Mask meets_field(const SceneView& scene, const BoundarySegment& s, Int mask) {
    const Int mesh = mesh_of(scene, field_of_line(scene, s.active, s.edge));
    return (gather(scene.mesh_mask, mesh) & mask) != 0;
}

// The part of light along w that a field stops beside a point at which w touches it. A line a little below
// that passes the surface twice.
EG_INLINE Vec3 stopped_by_field(const SceneView& scene, Mask active, Int face, Vec3 at, Vec3 normal, Vec3 w,
                                RayKind rays) {
    const Vec3 one = one3();
    if (!(scene.all_flags & kHasTransparency)) return one;
    const Int known = select(active, face, splat(scene.first_field_face));
    const Vec3 in = stopped_by(scene, active, known, splat(-1), at, onto_surface(w, normal), rays),
               out = stopped_by(scene, active, known, splat(-1), at, onto_surface(w, normal, true), rays);
    return one - (one - in) * (one - out);
}

// A point of the surface with a line that touches it there.
struct TouchingLine {
    PatchSample at;
    CurveExit exit;
    Float measure;  // one over the density of the point and the line, without that of the angle
};

// Samples a point of a field's surface. `v` completes the sample's place on its patch.
EG_INLINE SegmentSample begin_on_field(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                       SegmentCursor& cursor, TouchingLine& line, Float& angle,
                                       BoundarySegment& s) {
    SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    begin_segment(p, s);
    Float v;
    const float cells = cell_numbers(task, p, v, angle);
    place_on_patches(scene, s.active, s.edge, s.u, v, line.at);
    s.point = line.at.position;
    line.measure = line.at.area * (p.u1 - p.u0) / (p.density * splat(cells));
    return p;
}

// Sets the direction towards y of the lines, and what follows from it: the sweep, where rays start, and the
// normal, which points to the side of the lines. Returns the normal curvature along it for that normal.
EG_INLINE Float touch(const SceneView& scene, Vec3 towards, TouchingLine& line, BoundarySegment& s) {
    s.towards = towards;
    Float curvature, contact;
    find_tangent_rays(scene, s.active, s.edge, line.at, towards, curvature, contact);
    line.at.normal = select(curvature < 0.0f, -line.at.normal, line.at.normal);
    s.sweep = -line.at.normal;
    line.exit = exit_of_field(s, line.at.normal, contact);
    return abs(curvature);
}

// The angle of [0, pi] up to which middle + swing cos(angle) is positive, and its integral up to there.
EG_INLINE Float last_positive(Float middle, Float swing) {
    const Float ratio = min(max(-middle / max(swing, 1e-30f), splat(-1.0f)), splat(1.0f));
    return select(middle >= swing, splat(3.14159265f), acos(ratio));
}
EG_INLINE Float positive_curvature(Float middle, Float swing) {
    constexpr float kTurns = 0.5f / 3.14159265f;
    const Float most = last_positive(middle, swing);
    Float sine, cosine;
    sincos_turn(most * kTurns, sine, cosine);
    return max(middle * most + swing * sine, 0.0f);
}

// The angle of [0, most] up to which the integral of middle + swing cos(angle) is `part` of that up to
// `most`, where the integrand is positive. Sets the whole integral.
EG_INLINE Float angle_of_curvature(Float middle, Float swing, Float most, Float part, Float& whole) {
    constexpr int kSteps = 12;
    constexpr float kTurns = 0.5f / 3.14159265f;
    Float sine, cosine;
    sincos_turn(most * kTurns, sine, cosine);
    whole = middle * most + swing * sine;
    const Float wanted = part * whole;
    // Newton's method within the bracket of the root
    Float low = splat(0.0f), high = most, at = most * (1.0f - sqrt(max(1.0f - part, 0.0f)));
    for (int step = 0; step < kSteps; ++step) {
        sincos_turn(at * kTurns, sine, cosine);
        const Float off = middle * at + swing * sine - wanted, slope = middle + swing * cosine;
        low = select(off < 0.0f, at, low), high = select(off < 0.0f, high, at);
        const Float next = at - off / max(slope, 1e-30f);
        at = select((next >= low) & (next <= high), next, 0.5f * (low + high));
    }
    return at;
}

// Sets the direction of a tangent with a density proportional to its curvature, where that is positive:
// elsewhere the line is inside of the surface. Where light travels inside, the density is proportional to the
// curvature's size. `turn` is uniform. Completes the measure of the line.
EG_INLINE void touch_by_curvature(const SceneView& scene, Float turn, TouchingLine& line,
                                  BoundarySegment& s) {
    constexpr float kTurns = 0.5f / 3.14159265f;
    // The curvature at the angle psi from a is middle + swing cos(2 (psi - first))
    Vec3 a, b;
    basis(line.at.normal, a, b);
    Float middle, along, across;
    Mask inside;
    find_curvatures(scene, s.active, s.edge, line.at, a, b, middle, along, across, inside);
    const Float swing = sqrt(along * along + across * across);
    // Choose the side of the surface
    Float chosen = splat(1.0f);
    if (any(inside)) {
        const Float outer = positive_curvature(middle, swing), inner = positive_curvature(-middle, swing);
        const Float share = outer / max(outer + inner, 1e-30f);
        const Mask in = inside & (turn >= share);
        chosen = select(inside, select(in, 1.0f - share, share), chosen);
        turn = select(inside, (turn - select(in, share, 0.0f)) / max(chosen, 1e-30f), turn);
        const auto turned = [&](Float& value) { value = select(in, -value, value); };
        turned(middle), turned(along), turned(across);
        s.active &= chosen > 0.0f;
    }
    const Float first = 0.5f * atan2(across, along);
    s.active &= middle + swing > 0.0f;
    const Float most = last_positive(middle, swing);
    // Four parts of equal weight: two opposite directions, and two sides of the largest curvature
    const Float quarter = min(turn, splat(0.99999994f)) * 4.0f;
    const Mask back = quarter >= 2.0f;
    const Float side = quarter - select(back, splat(3.0f), 1.0f);
    Float whole;
    const Float angle = angle_of_curvature(middle, swing, most, abs(side), whole);
    Float psi = first + 0.5f * select(side < 0.0f, -angle, angle) + select(back, splat(3.14159265f), 0.0f);
    psi = psi * kTurns;
    psi = psi - floor(psi);
    Float sine, cosine;
    sincos_turn(min(psi, splat(0.99999994f)), sine, cosine);
    touch(scene, a * cosine + b * sine, line, s);
    line.measure = line.measure * (2.0f * whole / max(chosen, 1e-30f));
}

}  // namespace edgegrad::EDGEGRAD_ISA
