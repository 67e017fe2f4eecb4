// Rows of the light table: lights that are no meshes, and what they give in a direction.
#pragma once

#include "shading/light_shapes.h"

namespace edgegrad::EDGEGRAD_ISA {

// A row of the light table; the axes have the length of half the extents.
struct LightRow {
    Vec3 radiance, position, axis_x, axis_y, direction;
    Float radius, area, one_minus_cos, edge, edge_scale;
    Int flags;
};

EG_INLINE LightRow gather_light(const LightView& lights, Int row) {
    Float p[kLightEdgeScale + 1];
    gather_row(lights.params, kLightParams, row, p);
    const auto vector = [&](int place) { return Vec3{p[place], p[place + 1], p[place + 2]}; };
    return {vector(kLightRadiance),
            vector(kLightPosition),
            vector(kLightAxisX) * p[kLightExtentX],
            vector(kLightAxisY) * p[kLightExtentY],
            vector(kLightDirection),
            p[kLightRadius],
            p[kLightArea],
            p[kLightOneMinusCos],
            p[kLightEdge],
            p[kLightEdgeScale],
            gather(lights.flags, row)};
}

// What a spot's cone or an area light's grid lets through towards the side that -w comes from.
EG_INLINE Float light_factor(const LightRow& l, Vec3 w) {
    Float factor = splat(1.0f);
    const auto has = [&](LightFlag flag) { return (l.flags & static_cast<int>(flag)) != 0; };
    const Mask cone = has(kLightCone), linear = has(kLightLinearCone), spread = has(kLightSpread);
    if (!any(cone | linear | spread)) return factor;
    const Vec3 chord = w + l.direction;
    const Float chord2 = dot(chord, chord);  // 2 (1 - cos)
    if (any(cone)) {
        const Float t = min(max((l.edge - 0.5f * chord2) * l.edge_scale, 0.0f), splat(1.0f));
        factor = select(cone, t * t * (3.0f - 2.0f * t), factor);
    }
    if (any(linear)) {
        const Vec3 sum = l.direction - w;
        const Float angle = 2.0f * atan2(sqrt(chord2), sqrt(dot(sum, sum)));
        factor = select(linear, min(max((l.edge - angle) * l.edge_scale, 0.0f), splat(1.0f)), factor);
    }
    if (any(spread)) {
        const Float cosine = 1.0f - 0.5f * chord2;
        const Float tangent = sqrt(max(1.0f - cosine * cosine, 0.0f)) / max(cosine, 1e-6f);
        factor = select(spread, max((l.edge - tangent) * l.edge_scale, 0.0f), factor);
    }
    return factor;
}

// The area light as seen from a point: where it has a spread, the rectangle around what may shine there,
// which is the disk of the radius height * tan(spread/2) about the point's foot on the light.
EG_INLINE AreaShape area_shape(const LightRow& l, Vec3 from) {
    AreaShape shape{l.position - from, l.axis_x, l.axis_y, l.area};
    const Mask spread = (l.flags & static_cast<int>(kLightSpread)) != 0;
    if (!any(spread)) return shape;
    const Vec3 center = shape.center;
    const Float reach = -dot(center, l.direction) * l.edge;
    shape.area = select(spread, splat(4.0f), shape.area);
    Vec3* const axes[] = {&shape.axis_x, &shape.axis_y};
    for (Vec3* axis : axes) {
        const Float length = max(sqrt(dot(*axis, *axis)), 1e-30f);
        const Vec3 unit = *axis * (1.0f / length);
        const Float foot = -dot(center, unit);
        const Float low = max(-length, foot - reach), high = min(length, foot + reach);
        const Float half = max(0.5f * (high - low), 0.0f);
        shape.center = select(spread, shape.center + unit * (0.5f * (low + high)), shape.center);
        *axis = select(spread, unit * half, *axis);
        shape.area = select(spread, shape.area * half, shape.area);
    }
    return shape;
}

// Whether a point of an ellipse's plane, relative to its centre, is on it.
EG_INLINE Mask within_ellipse(const LightRow& l, Vec3 across) {
    const Float x = dot(across, l.axis_x) / dot(l.axis_x, l.axis_x);
    const Float y = dot(across, l.axis_y) / dot(l.axis_y, l.axis_y);
    return x * x + y * y <= 1.0f;
}

}  // namespace edgegrad::EDGEGRAD_ISA
