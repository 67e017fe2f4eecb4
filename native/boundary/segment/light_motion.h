// The motion of a segment's far end y with its light. This is the transpose of the parametrisation of the
// interior term (adjoint/light_arrival.h), in which a sample is a fixed point in the frame of its light. With
// the light at p and g the adjoint of y's velocity:
//   point               y = p
//   sphere              y = x + r w,                 w as for a cone below, d the unit p - x, sin = R/|p - x|
//   disk facing x       y = p + (a s + b t) R,       a, b the basis across p - x; s, t fixed
//   rectangle, ellipse  y = p + X s + Y t,           X, Y half the extents; s, t fixed
// For distant lights g is the adjoint of the velocity of the direction -w to the light:
//   direction           -w = d,                      d the direction opposite to the light's travel
//   cone                -w = (a s + b t) sin + d cos, 1 - cos = q (1 - cos of half its angle); q, s, t fixed.
// Fixing y on a sphere's surface instead would divide derivatives by the cosine there (derivations, C4).
#pragma once

#include "shading/lights/light_rows.h"

namespace edgegrad::EDGEGRAD_ISA {

// The LightKind of rows of the light table. Arbitrary for rows that emit no light.
EG_INLINE Int kind_of_rows(const LightView& lights, Int row) {
    Int kind = splat(0);
    for (int i = 0; i < W; ++i)
        if (row[i] >= 0 && lights.light_of_row[row[i]] >= 0)
            kind[i] = lights.kind[lights.light_of_row[row[i]]];
    return kind;
}

// Whether y depends on x.
EG_INLINE Mask turns_with_point(Int kind) {
    return (kind == splat(kSphereLight)) | (kind == splat(kDiskLight));
}

// The adjoint of the unit vector n, from those of its basis vectors (simd/vector.h).
EG_INLINE Vec3 basis_adjoint(Vec3 n, Vec3 ga, Vec3 gb) {
    const Float sign = select(n.z >= 0.0f, splat(1.0f), -1.0f);
    const Float p = -1.0f / (sign + n.z), mixed = sign * ga.y + gb.x;
    return {2.0f * sign * p * n.x * ga.x + p * n.y * mixed - sign * ga.z,
            p * n.x * mixed + 2.0f * p * n.y * gb.y - gb.z,
            p * p * (sign * n.x * n.x * ga.x + n.x * n.y * mixed + n.y * n.y * gb.y)};
}

// The adjoints of a cone's axis and cap (1 - cos of half its angle), from that of a direction w in the cone.
struct ConeMotion {
    Vec3 axis;
    Float cap;
};

EG_INLINE ConeMotion cone_motion(Vec3 axis, Float cap, Vec3 w, Vec3 g) {
    Vec3 a, b;
    basis(axis, a, b);
    const Float s = dot(w, a), t = dot(w, b), z = dot(w, axis), sine2 = max(s * s + t * t, 1e-37f);
    const Float q = rise_from_axis(sine2, z) / max(cap, 1e-30f);
    const Float widens = dot(g, a * s + b * t) * (z * q / sine2) - q * dot(g, axis);
    return {g * z + basis_adjoint(axis, g * s, g * t), widens};
}

// Sets three columns of rows.
EG_INLINE void set_three(Float (&row)[kLightParams], int at, Mask m, Vec3 v) {
    row[at] = select(m, v.x, row[at]), row[at + 1] = select(m, v.y, row[at + 1]);
    row[at + 2] = select(m, v.z, row[at + 2]);
}

// Sets the adjoints of the light's row. `offset` is y - x, or the unit direction of distant lights. Returns
// the adjoint of x, on which disks that face x and cones about spheres depend.
EG_INLINE Vec3 light_motion_row(const LightView& lights, Int light, Int kind, Vec3 x, Vec3 offset, Vec3 g,
                                Float (&row)[kLightParams]) {
    for (Float& r : row) r = splat(0.0f);
    Vec3 from = zero3();
    const LightRow l = gather_light(lights, light);
    const auto is = [&](LightKind k) { return kind == splat(k); };
    const auto put = [&](int at, Mask m, Vec3 v) { set_three(row, at, m, v); };
    const Mask near = kind < splat(kDirectionLight), cone = is(kConeLight);
    const Vec3 place = x + offset - l.position;
    // Point lights, and the centres of disks, rectangles and ellipses
    put(kLightPosition, near, g);
    const Mask disk = is(kDiskLight), sphere = is(kSphereLight);
    // Disks turn with p - x
    if (any(disk)) {
        const Vec3 unit = place * (1.0f / max(l.radius, 1e-30f));
        row[kLightRadius] = select(disk, dot(g, unit), row[kLightRadius]);
        const Vec3 way = l.position - x;
        const Float inverse = 1.0f / max(sqrt(dot(way, way)), 1e-30f);
        const Vec3 axis = way * inverse;
        Vec3 a, b;
        basis(axis, a, b);
        const Vec3 turned = basis_adjoint(axis, g * dot(place, a), g * dot(place, b));
        const Vec3 across = (turned - axis * dot(axis, turned)) * inverse;
        put(kLightPosition, disk, g + across);
        from = select(disk, -across, from);
    }
    const Mask flat = is(kRectangleLight) | is(kEllipseLight);
    // Rectangles and ellipses stretch with their half axes
    if (any(flat)) {
        const auto axis = [&](int at, int extent, Vec3 half) {
            const Float share = dot(place, half) / max(dot(half, half), 1e-37f);
            const Float length = gather(lights.params + extent, light * static_cast<int32_t>(kLightParams));
            put(at, flat, g * (share * length));
            row[extent] = select(flat, dot(g, half) * share / max(length, 1e-37f), row[extent]);
        };
        axis(kLightAxisX, kLightExtentX, l.axis_x);
        axis(kLightAxisY, kLightExtentY, l.axis_y);
    }
    // Suns turn, and cones of directions widen
    put(kLightDirection, is(kDirectionLight), -g);
    if (any(cone)) {
        const ConeMotion m = cone_motion(-l.direction, l.one_minus_cos, offset, g);
        row[kLightOneMinusCos] = select(cone, m.cap, row[kLightOneMinusCos]);
        put(kLightDirection, cone, -m.axis);
    }
    // Spheres move the cone in which x sees them
    if (any(sphere)) {
        const SphereCone seen = sphere_cone(l.position - x, l.radius);
        const Float r = sqrt(dot(offset, offset)), inverse = 1.0f / seen.distance;
        const ConeMotion m = cone_motion(seen.axis, seen.cap, offset * (1.0f / max(r, 1e-30f)), g * r);
        // By sin^2 = R^2/d^2. From inside the sphere, the cone contains all directions.
        const Mask outside = l.radius < seen.distance;
        const Float by_sine2 = select(outside, m.cap * 0.5f / max(1.0f - seen.cap, 1e-6f), splat(0.0f));
        const Float ratio = l.radius * inverse;
        row[kLightRadius] = select(sphere, by_sine2 * 2.0f * ratio * inverse, row[kLightRadius]);
        const Vec3 by_center =
            (m.axis - seen.axis * (dot(seen.axis, m.axis) + by_sine2 * 2.0f * ratio * ratio)) * inverse;
        put(kLightPosition, sphere, by_center);
        from = select(sphere, g - by_center, from);
    }
    return from;
}

// The same for a point y fixed on a sphere's surface, y = p + n R. Only the component of g along n matters.
EG_INLINE void sphere_surface_row(const LightView& lights, Mask sphere, Int light, Vec3 y, Vec3 g,
                                  Float (&row)[kLightParams]) {
    const LightRow l = gather_light(lights, light);
    const Float radius = dot(g, y - l.position) / max(l.radius, 1e-30f);
    set_three(row, kLightPosition, sphere, g);
    row[kLightRadius] = select(sphere, radius, row[kLightRadius]);
}

}  // namespace edgegrad::EDGEGRAD_ISA
