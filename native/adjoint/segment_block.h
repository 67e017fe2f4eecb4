// Segments between two points, as one block each on the tape (adjoint/blocks.h). Results: the direction, and
// the relative measure of the light that arrives along the segment.
#pragma once

#include "adjoint/blocks.h"

namespace edgegrad::EDGEGRAD_ISA {

// The segment from x to y: its unit direction w, and its measure divided by its own value, which is 1. The
// measure is |w.M| / r^2 with the area normal M of the surface at y, or 1 / r^2 if y is a point light.
struct Segment {
    Vec3 w;
    Float measure;
};

// The adjoints of d = y - x and of M, given those of w and of the measure:  log |w.M|/r^2 = log |d.M| - 3 log
// r.
struct RawSegment {
    RawVec3 w, by_area;  // M / (w.M)
    raw::Float inverse_r;
    raw::Float inverse_m;  // 1 / (w.M); 0 where the measure is constant
    raw::Float power;      // exponent of r in the measure

    EG_INLINE RawVec3 set(const RawVec3& from, const RawVec3& to, const RawVec3& m, raw::Mask point) {
        const RawVec3 d = to - from;
        const raw::Float square = dot(d, d);
        inverse_r = finite_inverse(raw::sqrt(square));
        w = d * inverse_r;
        const raw::Float facing = dot(w, m);
        const raw::Mask flat = ~point & (raw::abs(facing) * (inverse_r * inverse_r) > 1e-37f);
        inverse_m = raw::select(flat, finite_inverse(facing), 0.0f);
        by_area = m * inverse_m;
        power = raw::select(flat, raw::splat(3.0f), raw::select(point, raw::splat(2.0f), 0.0f));
        return w;
    }
    // Scales the derivatives by the weight of the material form.
    EG_INLINE void scale(raw::Float share) {
        inverse_r = inverse_r * share;
        inverse_m = inverse_m * share;
    }
    EG_INLINE RawVec3 distance_adjoint(const RawVec3& g, raw::Float measure) const {
        return ((by_area - w * power) * measure + across(g, w)) * inverse_r;
    }
    EG_INLINE RawVec3 area_adjoint(raw::Float measure) const { return w * (measure * inverse_m); }
    EG_INLINE void forward(const RawVec3& d, const RawVec3& m, raw::Mask live, raw::Float* a,
                           int32_t first) const {
        write(a, first, live, across(d, w) * inverse_r);
        const raw::Float measure = dot(by_area - w * power, d) * inverse_r + dot(w, m) * inverse_m;
        a[first + 3] = raw::select(live, measure, 0.0f);
    }
};

struct SegmentBlock {
    static constexpr int kResults = 4;
    int32_t first;
    Nodes3 x, y, m;
    RawSegment segment;

    void backward(raw::Float* a) const {
        const RawVec3 turn = read(a, first);
        const raw::Float measure = a[first + 3];
        const raw::Mask live = nonzero(turn) | (measure != 0.0f);
        const RawVec3 g = segment.distance_adjoint(turn, measure);
        add(a, y, live, g);
        add(a, x, live, raw_zero3() - g);
        add(a, m, live, segment.area_adjoint(measure));
    }
    void forward(raw::Float* a) const {
        const RawVec3 from = read(a, x), to = read(a, y), area = read(a, m);
        segment.forward(to - from, area, nonzero(from) | nonzero(to) | nonzero(area), a, first);
    }
};

// The segment to a point of a light's shape with the area normal m. `point`: the light has no size.
EG_INLINE Segment segment_to(Vec3 x, Vec3 y, Vec3 m, Mask point) {
    if (!taped(nodes(x)) && !taped(nodes(y)) && !taped(nodes(m))) {
        RawSegment s;
        return {constant3(s.set(values(x), values(y), values(m), point)), splat(1.0f)};
    }
    SegmentBlock& block = current_tape->new_block<SegmentBlock>();
    block.x = nodes(x), block.y = nodes(y), block.m = nodes(m);
    const RawVec3 w = block.segment.set(values(x), values(y), values(m), point);
    return {results(w, block.first), {raw::splat(1.0f), block.first + 3}};
}

struct FaceSegmentBlock {
    static constexpr int kResults = 4;
    int32_t first;
    Nodes3 x;
    RawTriangle triangle;
    RawSegment segment;
    bool drifts;
    RawVec3 drift;  // the measure changes by drift . (dx - dy)

    void backward(raw::Float* a) const {
        const RawVec3 turn = read(a, first);
        const raw::Float measure = a[first + 3];
        const raw::Mask live = nonzero(turn) | (measure != 0.0f);
        RawVec3 g = segment.distance_adjoint(turn, measure);
        if (drifts) g = g - drift * measure;
        add(a, x, live, raw_zero3() - g);
        triangle.backward(a, live, g, segment.area_adjoint(measure));
    }
    void forward(raw::Float* a) const {
        RawVec3 y, m;
        const RawVec3 from = read(a, x);
        const raw::Mask live = nonzero(from) | triangle.forward(a, y, m);
        segment.forward(y - from, m, live, a, first);
        if (drifts) a[first + 3] = a[first + 3] + raw::select(live, dot(drift, from - y), 0.0f);
    }
};

// Motion of a segment's far end: a blend of material form and fixed direction (scene/contact.h).
struct FarMotion {
    raw::Float material_form;  // weight of the material form
    RawVec3 drift;
};
EG_INLINE FarMotion far_motion(Mask material_form) { return {all_of(material_form), raw_zero3()}; }

// The segment to a point of a triangle.
EG_INLINE Segment segment_to(Vec3 x, const Triangle& t, raw::Float b1, raw::Float b2,
                             const FarMotion& motion) {
    const auto run = [&](RawTriangle& triangle, RawSegment& segment) {
        triangle.set(t, b1, b2);
        const RawVec3 y = values(t.p0) + triangle.e1 * b1 + triangle.e2 * b2;
        return segment.set(values(x), y, cross(triangle.e1, triangle.e2), raw::splat(0));
    };
    const bool drifts = raw::any(nonzero(motion.drift));
    if ((!taped(nodes(x)) && !taped(t)) || !(drifts || raw::any(motion.material_form > 0.0f))) {
        RawTriangle triangle;
        RawSegment segment;
        return {constant3(run(triangle, segment)), splat(1.0f)};
    }
    FaceSegmentBlock& block = current_tape->new_block<FaceSegmentBlock>();
    block.x = nodes(x);
    const RawVec3 w = run(block.triangle, block.segment);
    block.segment.scale(motion.material_form);
    block.drifts = drifts, block.drift = motion.drift;
    return {results(w, block.first), {raw::splat(1.0f), block.first + 3}};
}

}  // namespace edgegrad::EDGEGRAD_ISA
