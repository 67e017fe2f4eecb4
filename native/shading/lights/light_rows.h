// Rows of the light table: lights that are not meshes, and their radiance by direction.
#pragma once

#include "shading/bsdf/distributions/tail.h"
#include "shading/lights/light_shapes.h"

namespace edgegrad::EDGEGRAD_ISA {

// A row of the light table. The axes are half the extents long.
struct LightRow {
    Vec3 radiance, position, axis_x, axis_y, direction;
    Float radius, area, one_minus_cos, edge, edge_scale, smooth;
    Int flags;
};

EG_INLINE LightRow gather_light(const LightView& lights, Int row) {
    Float p[kLightSmooth + 1];
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
            p[kLightSmooth],
            gather(lights.flags, row)};
}

// What is followed for light of a row of the light table; row < 0: for any other light.
EG_INLINE Followed followed_for(const SceneView& scene, Mask active, Int row) {
    const Followed others{splat(scene.followed_alpha)};
    if (!scene.light_followed) return others;
    const Mask of_table = active & (row >= 0);
    const Int at = select(of_table, row, splat(0));
    return select(of_table, {gather(scene.light_followed, at), gather(scene.light_tail, at)}, others);
}

// What surfaces throw (path/lights/thrown_light.h) of light of a row or, if both are negative, of the
// environment, of which this is `followed`. They throw no light of faces.
EG_INLINE Followed thrown_of(const SceneView& scene, Int row, Int face, const Followed& followed) {
    return select((row >= 0) | (face < 0), {min(followed.widest, splat(scene.thrown_alpha)), followed.tail},
                  Followed());
}

// The share of a row of the light table that rays meet. Emitter samples find the rest.
EG_INLINE Float share_of_row(const SceneView& scene, int row, const RayLobe& lobe) {
    if (!scene.light_followed) return splat(1.0f);
    return share_of_rays(lobe, {splat(scene.light_followed[row]), splat(scene.light_tail[row])});
}

// Share of the light that a spot's cone or an area light's grid transmits in the direction -w.
EG_INLINE Float light_factor(const LightRow& l, Vec3 w) {
    Float factor = splat(1.0f);
    const auto has = [&](LightFlag flag) { return (l.flags & static_cast<int>(flag)) != 0; };
    const Mask cone = has(kLightCone), linear = has(kLightLinearCone), spread = has(kLightSpread);
    if (!any(cone | linear | spread)) return factor;
    const Vec3 chord = w + l.direction;
    const Float chord2 = dot(chord, chord);  // 2 (1 - cos)
    if (any(cone)) {
        Float rise = 0.5f * chord2;
        const Mask stretched = has(kLightStretched);
        if (any(stretched)) {
            const Float x = dot(w, l.axis_x), y = dot(w, l.axis_y), z = -dot(w, l.direction);
            const Float across2 = x * x + y * y, inverse2 = 1.0f / max(across2 + z * z, 1e-30f);
            rise = select(stretched, rise_from_axis(across2 * inverse2, z * sqrt(inverse2)), rise);
        }
        const Float t = min(max((l.edge - rise) * l.edge_scale, 0.0f), splat(1.0f));
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

// The factor of light whose decay is not the inverse square of the distance r between light and receiver.
EG_INLINE Float distance_factor(const LightRow& l, Float r) {
    const Mask decays = (l.flags & static_cast<int>(kLightDecay)) != 0;
    if (!any(decays)) return splat(1.0f);
    r = select(decays, r, splat(1.0f));
    const Float r2 = r * r;
    const Float by = select((l.flags & static_cast<int>(kLightByWay2)) != 0, r2,
                            select((l.flags & static_cast<int>(kLightByWay)) != 0, r, splat(1.0f)));
    return select(decays, by * (r2 / max(r2 + l.smooth, 1e-37f)), splat(1.0f));
}

// The share of a light's radiance that arrives from the direction w after the distance r.
EG_INLINE Float light_factor(const LightRow& l, Vec3 w, Float r) {
    return light_factor(l, w) * distance_factor(l, r);
}

// The area light as seen from a point. With a spread, only a part of the light shines there: the disk with
// the radius height * tan(spread/2) about the point's projection onto the light. The shape is then the
// rectangle around that part.
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

// Returns whether a point of an ellipse's plane, relative to its centre, is in the ellipse.
EG_INLINE Mask within_ellipse(const LightRow& l, Vec3 across) {
    const Float x = dot(across, l.axis_x) / dot(l.axis_x, l.axis_x);
    const Float y = dot(across, l.axis_y) / dot(l.axis_y, l.axis_y);
    return x * x + y * y <= 1.0f;
}

// Intersects a ray along w with a sized light of the table. Returns the distance from `from`: negative for a
// miss, infinite for suns. `pdf` is the density of emitter samples there.
EG_INLINE Float meet_light(const LightRow& l, int kind, Vec3 from, Vec3 w, Float& pdf) {
    const Vec3 center = l.position - from;
    switch (kind) {
        case kSphereLight:
            pdf = sphere_pdf(center, l.radius);
            return sphere_distance(center, l.radius, w);
        case kDiskLight: {
            const Float d2 = dot(center, center);
            const Float distance = d2 / dot(center, w);
            const Vec3 offset = w * distance, across = offset - center;
            pdf = area_pdf(offset, center, l.radius * l.radius * 3.14159265f);
            return select(dot(across, across) <= l.radius * l.radius, distance, splat(-1.0f));
        }
        case kRectangleLight:
        case kEllipseLight: {
            const Float facing = -dot(w, l.direction);
            const Float distance = -dot(center, l.direction) / select(facing > 0.0f, facing, 1.0f);
            const Vec3 offset = w * distance, across = offset - center;
            const bool rectangle = kind == kRectangleLight;
            const auto inside = [&](Vec3 axis) { return abs(dot(across, axis)) <= dot(axis, axis); };
            const Mask hit = (facing > 0.0f) &
                             (rectangle ? inside(l.axis_x) & inside(l.axis_y) : within_ellipse(l, across));
            if (any(hit)) {
                const AreaShape shape = area_shape(l, from);
                const bool by_rectangle = rectangle || any((l.flags & static_cast<int>(kLightSpread)) != 0);
                pdf = by_rectangle ? rectangle_pdf(shape, offset) : area_pdf(offset, l.direction, l.area);
            }
            return select(hit, distance, splat(-1.0f));
        }
        default: {
            const Vec3 chord = w + l.direction;
            pdf = 1.0f / l.area;
            return select(0.5f * dot(chord, chord) <= l.one_minus_cos, splat(__builtin_inff()), splat(-1.0f));
        }
    }
}

// Whether a light of the table shines on rays of `kind` and on the mesh that scattered them, which the path
// has met after `bounces`.
EG_INLINE bool shines_along(const SceneView& scene, int row, int from_mesh, int kind, int bounces) {
    const LightView& lights = scene.lights;
    const int receivers = lights.receivers[row];
    return (lights.visible_to[row] >> meets_as(kind) & 1) && bounces <= lights.max_bounces[row] &&
           (receivers < 0 || kind == kCameraRay || (scene.mesh_receivers[from_mesh] >> receivers & 1));
}

// Visits the sized lights of the table that rays of `kind` along w meet between the distances near and far
// from the point `from`, if they shine on such rays and on the mesh that scattered them, which the path has
// met after `bounces`. Lights do not block rays. Calls visit(row's number, mask, row, distance, density of
// emitter samples there without the choice of the light).
template <typename Visit>
EG_INLINE void for_each_met_light(const SceneView& scene, Mask active, Vec3 from, Int from_mesh, Vec3 w,
                                  Float near, Float far, Int kind, Int bounces, const Visit& visit) {
    if (!any(active)) return;
    const LightView& lights = scene.lights;
    const Mask missed = active & (far == __builtin_inff());
    const int count = lights.sized_count + (lights.sized_distant && any(missed) ? lights.sized_distant : 0);
    for (int k = 0; k < count; ++k) {
        const int row = lights.sized[k];
        Mask seen = active;
        for (int i = 0; i < W; ++i)
            seen[i] &= shines_along(scene, row, from_mesh[i], kind[i], bounces[i]) ? -1 : 0;
        if (!any(seen)) continue;
        const int light_kind = lights.kind[lights.light_of_row[row]];
        const LightRow l = gather_light(lights, splat(row));
        Float pdf = splat(0.0f);
        const Float distance = meet_light(l, light_kind, from, w, pdf);
        seen &= (distance > near) & (distance <= far);
        if (light_kind >= kDirectionLight) seen &= missed;
        if (any(seen)) visit(row, seen, l, distance, pdf);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
