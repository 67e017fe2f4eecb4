// Lights of the table that lie between two neighbouring places of a scan line, or beside it: the chains at
// both places meet the same surfaces and pass a light, and a chain in between or nearby meets it.
#pragma once

#include "boundary/specular/scan_segments.h"

namespace edgegrad::EDGEGRAD_ISA {

// How far off the interpolated ray may pass a light, in units of the light's size, for a chain to be traced
// there. Chains are not linear in the place.
constexpr float kNearEnough = 1.5f;

// Where a ray from p along the unit vector d passes a light, relative to the light's centre and in units of
// its size: at most 1 long within ellipses, disks, spheres and suns. `ahead`: the ray runs towards the light.
EG_INLINE Vec3 offset_from_light(const LightRow& l, int kind, Vec3 p, Vec3 d, Mask& ahead) {
    const Vec3 center = l.position - p;
    if (kind == kSphereLight || kind == kConeLight) {
        const SphereCone cone = sphere_cone(center, l.radius);
        const bool sun = kind == kConeLight;
        const Vec3 axis = sun ? -l.direction : cone.axis;
        ahead = dot(d, axis) > 0.0f;
        return (d - axis) * (1.0f / sqrt(max(2.0f * (sun ? l.one_minus_cos : cone.cap), 1e-37f)));
    }
    const Vec3 n = kind == kDiskLight ? center : l.direction;
    const Float facing = dot(d, n);
    const Float distance = dot(center, n) / select(abs(facing) > 1e-30f, facing, splat(1e-30f));
    ahead = distance > 0.0f;
    const Vec3 across = d * distance - center;
    if (kind == kDiskLight) return across * (1.0f / max(l.radius, 1e-30f));
    return {dot(across, l.axis_x) / max(dot(l.axis_x, l.axis_x), 1e-37f),
            dot(across, l.axis_y) / max(dot(l.axis_y, l.axis_y), 1e-37f), splat(0.0f)};
}

// The light that chains pass nearest: between two places of a line, at the fraction `at` of the way.
struct PassedLight {
    Mask found, inside;  // near enough; so near that a chain there may meet the light
    Int row, level;      // of the light table; the vertex after the ray that passes it
    Float at;
    Vec3 step;  // change of the offset from the light between both places
};

// Finds the light of the table that the chains a and b, which do not differ, pass nearest between them.
// `far`: up to this distance, in units of the way between both.
EG_OUTLINE PassedLight passed_light(const SceneView& scene, Mask active, const ChainChoices& choices,
                                    const SpecularChain& a, const SpecularChain& b, float far) {
    const LightView& lights = scene.lights;
    PassedLight out{splat(0), splat(0), splat(-1), splat(0), splat(0.5f), zero3()};
    Mask bent = splat(0);
    Float nearest = splat(1e30f);
    for (int level = 1; level < kMostChain; ++level) {
        const Int event = choices.event[level - 1];
        bent |= (event >= 0) & (event != kEventPasses) & (event != kEventLit);
        const Mask here = active & bent & (level < a.count) & (level < b.count) & (level <= choices.lit) &
                          (a.key[level] >= splat(kMissed));
        if (!any(here)) continue;
        const Mask missed = a.key[level] == splat(kMissed);
        for (int k = 0; k < lights.all_sized(); ++k) {
            const int row = lights.sized[k], kind = lights.kind[lights.light_of_row[row]];
            const Mask may = kind == kConeLight ? here & missed : here;
            if (!any(may)) continue;
            const LightRow l = gather_light(lights, splat(row));
            Mask ahead_a, ahead_b;
            const Vec3 from = offset_from_light(l, kind, a.from[level], a.direction[level], ahead_a),
                       to = offset_from_light(l, kind, b.from[level], b.direction[level], ahead_b);
            const Vec3 step = to - from;
            const Float length2 = dot(step, step), part = -dot(from, step) / max(length2, 1e-30f);
            const Vec3 off = from + step * part;
            const Float square = dot(off, off);
            const Mask near = square < max(length2 * splat(far * far), splat(kNearEnough * kNearEnough));
            const Mask nearer = may & ahead_a & ahead_b & (part > 0.0f) & (part < 1.0f) &
                                (dot(from, from) > 1.0f) & (dot(to, to) > 1.0f) & near & (square < nearest);
            nearest = select(nearer, square, nearest), out.at = select(nearer, part, out.at);
            out.row = select(nearer, splat(row), out.row),
            out.level = select(nearer, splat(level), out.level);
            out.step = select(nearer, step, out.step);
            out.found |= nearer;
        }
    }
    out.inside = out.found & (nearest < kNearEnough * kNearEnough);
    return out;
}

// The offset of chain `c` in lane i from the light that it passes.
EG_INLINE Vec3 offset_in_lane(const SceneView& scene, const PassedLight& light, const SpecularChain& c,
                              int i) {
    const LightView& lights = scene.lights;
    const int row = light.row[i], level = light.level[i];
    const Vec3 &p = c.from[level], &d = c.direction[level];
    Mask ahead;
    return offset_from_light(gather_light(lights, splat(row)), lights.kind[lights.light_of_row[row]],
                             {splat(p.x[i]), splat(p.y[i]), splat(p.z[i])},
                             {splat(d.x[i]), splat(d.y[i]), splat(d.z[i])}, ahead);
}

// The distance in pixels up to which lines of the first pass find lights beside them, and the weight of what
// they find: several lines find the same light.
constexpr float kGuidedFrom = 1.5f, kGuideWeight = 0.25f;

// Finds the lights that chains pass beside the line: near `between`, where the chain is `middle`, the offset
// from the light is nearly linear in the place. Sets `place` to where it vanishes and `beside` to the chain
// there. Returns the lanes in which that chain differs.
EG_OUTLINE Mask find_beside(const SceneView& scene, const ScanTask& task, Mask near, const PassedLight& light,
                            const SegmentPair& s, int half, const PicturePoint& between,
                            const SpecularChain& middle, ChainChoices& choices, PicturePoint& place,
                            SpecularChain& beside) {
    const Float side = splat(kScanSegment);
    place = between;
    place.x = select(s.horizontal, place.x, place.x + side);
    place.y = select(s.horizontal, place.y + side, place.y);
    trace_chain<false>(scene, task, near, place, s.stream, choices, beside);
    near &= first_difference(middle, beside, near) < 0;
    near &= (light.level < middle.count) & (light.level < beside.count);
    place = between;
    for (int i = 0; i < W; ++i) {
        if (!near[i]) continue;
        const Vec3 off = offset_in_lane(scene, light, middle, i);
        const Vec3 across = (offset_in_lane(scene, light, beside, i) - off) * splat(1.0f / kScanSegment);
        const Vec3 step = {splat(light.step.x[i]), splat(light.step.y[i]), splat(light.step.z[i])};
        const bool flat = s.horizontal[i];
        const float way = flat ? s.end[half].x[i] - s.chosen.x[i] : s.end[half].y[i] - s.chosen.y[i];
        const Vec3 along = step * splat(1.0f / way);
        // Solve off + x along + y across = 0 by least squares
        const float a = dot(along, along)[0], b = dot(along, across)[0], c = dot(across, across)[0],
                    p = dot(along, off)[0], q = dot(across, off)[0], det = a * c - b * b;
        const float x = (b * q - c * p) / det, y = (b * p - a * q) / det;
        if (!(det > 1e-6f * a * c && __builtin_fabsf(x) < kGuidedFrom && __builtin_fabsf(y) < kGuidedFrom)) {
            near[i] = 0;
            continue;
        }
        place.x[i] += flat ? x : y, place.y[i] += flat ? y : x;
    }
    near &= (place.x >= task.low[0]) & (place.x < task.high[0]) & (place.y >= task.low[1]) &
            (place.y < task.high[1]);
    if (!any(near)) return near;
    trace_chain<false>(scene, task, near, place, s.stream, choices, beside);
    return near & (first_difference(middle, beside, near) >= 0);
}

}  // namespace edgegrad::EDGEGRAD_ISA
