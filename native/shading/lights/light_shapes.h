// Shapes of lights as seen from a point: sampling of directions, and their solid-angle densities.
#pragma once

#include "shading/lights/cone.h"
#include "shading/lights/spherical_triangle.h"

namespace edgegrad::EDGEGRAD_ISA {

constexpr float kInvFourPi = 0.0795774715f;
// Below this solid angle, points are sampled uniformly by area: cosine and distance hardly vary, while
// directions become inaccurate.
constexpr float kLeastSolidAngle = 1e-5f;

// A direction to a light, met or sampled from a point.
struct ShapeSample {
    Vec3 offset;  // from the point to the light; unit direction of distant lights
    Float pdf;    // per solid angle; 0: never found
};

// ---- Triangles: corners relative to the point, m = (p1 - p0) x (p2 - p0) ----

// Normalizes m by its largest component first, because products of small lights would underflow.
EG_INLINE Float area_pdf(Vec3 offset, Vec3 m, Float area) {
    const Vec3 n = m * (1.0f / max(max(max(abs(m.x), abs(m.y)), abs(m.z)), 1e-37f));
    const Float r2 = dot(offset, offset);
    const Float facing = abs(dot(offset, n)) / sqrt(max(dot(n, n), 1e-37f));  // r cos
    return r2 * sqrt(r2) / max(area * facing, 1e-37f);
}

// Barycentrics of the point where the ray along w meets a triangle.
EG_INLINE void barycentrics(const Triangle& t, Vec3 w, Float& b1, Float& b2) {
    const Vec3 c = cross(t.p0, w);
    Float weight0 = dot(w, cross(t.p1, t.p2)), weight1 = dot(c, t.p2), weight2 = -dot(c, t.p1);
    const Mask negative = weight0 + weight1 + weight2 < 0.0f;
    weight0 = max(select(negative, -weight0, weight0), 0.0f);
    weight1 = max(select(negative, -weight1, weight1), 0.0f);
    weight2 = max(select(negative, -weight2, weight2), 0.0f);
    const Float scale = 1.0f / max(weight0 + weight1 + weight2, 1e-37f);
    b1 = weight1 * scale;
    b2 = weight2 * scale;
}

// Small triangles are sampled uniformly by area. Cosine and distance vary too little across them to justify
// the cost of directions uniform in solid angle. The test compares the longer side at the first corner with
// the distance to the nearest corner.
constexpr float kSmallTriangle2 = 0.01f;

EG_INLINE Mask is_small_triangle(const Triangle& t) {
    const Vec3 e1 = t.p1 - t.p0, e2 = t.p2 - t.p0;
    const Float near = min(dot(t.p0, t.p0), min(dot(t.p1, t.p1), dot(t.p2, t.p2)));
    return max(dot(e1, e1), dot(e2, e2)) < kSmallTriangle2 * near;
}

EG_INLINE ShapeSample sample_triangle_light(const Triangle& t, Vec3 m, Float u, Float v, Float& b1,
                                            Float& b2) {
    Mask small = is_small_triangle(t);
    const Float root = sqrt(u);
    b1 = root * (1.0f - v);
    b2 = root * v;
    Float pdf = splat(0.0f);
    if (any(~small)) {
        const SphericalTriangle s = spherical_triangle(t.p0, t.p1, t.p2, m);
        small |= s.solid_angle < kLeastSolidAngle;
        pdf = 1.0f / max(s.solid_angle, 1e-37f);
        Float c1, c2;
        barycentrics(t, sample_triangle(s, u, v), c1, c2);
        b1 = select(small, b1, c1);
        b2 = select(small, b2, c2);
    }
    ShapeSample out{interpolate(t, b1, b2), pdf};
    if (any(small)) out.pdf = select(small, area_pdf(out.offset, m, 0.5f * sqrt(dot(m, m))), out.pdf);
    return out;
}

EG_INLINE Float triangle_light_pdf(const Triangle& t, Vec3 m, Vec3 offset) {
    Mask small = is_small_triangle(t);
    Float pdf = splat(0.0f);
    if (any(~small)) {
        const Float solid_angle = spherical_triangle(t.p0, t.p1, t.p2, m).solid_angle;
        small |= solid_angle < kLeastSolidAngle;
        pdf = 1.0f / max(solid_angle, 1e-37f);
    }
    return any(small) ? select(small, area_pdf(offset, m, 0.5f * sqrt(dot(m, m))), pdf) : pdf;
}

// ---- Area lights ----

struct AreaShape {
    Vec3 center;          // relative to the point
    Vec3 axis_x, axis_y;  // half the extents
    Float area;
};

// The rectangle, split into two spherical triangles with a common apex.
struct SphericalRectangle {
    SphericalTriangle first, second;
    Float solid_angle;
};

EG_INLINE SphericalRectangle spherical_rectangle(const AreaShape& r) {
    const Vec3 p0 = r.center - r.axis_x - r.axis_y, p1 = r.center + r.axis_x - r.axis_y;
    const Vec3 p2 = r.center + r.axis_x + r.axis_y, p3 = r.center - r.axis_x + r.axis_y;
    const Vec3 m = cross(r.axis_x, r.axis_y) * splat(4.0f);
    SphericalRectangle s{spherical_triangle(p0, p1, p2, m), spherical_triangle(p0, p2, p3, m), {}};
    s.solid_angle = s.first.solid_angle + s.second.solid_angle;
    return s;
}

EG_INLINE ShapeSample sample_rectangle(const AreaShape& r, Float u, Float v) {
    const SphericalRectangle s = spherical_rectangle(r);
    const Mask small = s.solid_angle < kLeastSolidAngle;
    const Vec3 m = cross(r.axis_x, r.axis_y);
    ShapeSample out{r.center + r.axis_x * (2.0f * u - 1.0f) + r.axis_y * (2.0f * v - 1.0f),
                    1.0f / max(s.solid_angle, 1e-37f)};
    if (any(small)) out.pdf = select(small, area_pdf(out.offset, m, r.area), out.pdf);
    if (any(~small)) {
        const Float at = u * s.solid_angle;
        const Mask second = at >= s.first.solid_angle;
        SphericalTriangle t;
        t.apex = s.first.apex;
        t.first = select(second, s.second.first, s.first.first);
        t.last = select(second, s.second.last, s.first.last);
        t.volume = select(second, s.second.volume, s.first.volume);
        t.solid_angle = select(second, s.second.solid_angle, s.first.solid_angle);
        const Float part = select(second, at - s.first.solid_angle, at) / max(t.solid_angle, 1e-37f);
        const Vec3 w = sample_triangle(t, min(part, splat(1.0f)), v);
        const Float distance = dot(r.center, m) / dot(w, m);
        out.offset = select(small, out.offset, w * distance);
    }
    return out;
}

EG_INLINE Float rectangle_pdf(const AreaShape& r, Vec3 offset) {
    const Float solid_angle = spherical_rectangle(r).solid_angle;
    return select(solid_angle < kLeastSolidAngle, area_pdf(offset, cross(r.axis_x, r.axis_y), r.area),
                  1.0f / max(solid_angle, 1e-37f));
}

EG_INLINE ShapeSample sample_ellipse(const AreaShape& e, Float u, Float v) {
    Float x, y;
    sample_disk(u, v, x, y);
    const Vec3 offset = e.center + e.axis_x * x + e.axis_y * y;
    return {offset, area_pdf(offset, cross(e.axis_x, e.axis_y), e.area)};
}

// ---- Spheres, and disks that face the receiver ----

// 1 - cos of a sphere's angular radius. From inside the sphere it covers all directions.
EG_INLINE Float sphere_cap(Float d2, Float radius) {
    const Float sine2 = radius * radius / max(d2, 1e-37f);
    return select(sine2 < 1.0f, sine2 / (1.0f + sqrt(max(1.0f - sine2, 0.0f))), splat(2.0f));
}

// The cone of directions to a sphere.
struct SphereCone {
    Vec3 axis;  // unit, to the centre
    Float distance, cap;
};

EG_INLINE SphereCone sphere_cone(Vec3 center, Float radius) {
    const Float d2 = dot(center, center), distance = sqrt(max(d2, 1e-37f));
    const Vec3 axis =
        select(d2 > 0.0f, center * (1.0f / distance), Vec3{splat(0.0f), splat(0.0f), splat(1.0f)});
    return {axis, distance, sphere_cap(d2, radius)};
}

EG_INLINE Float sphere_pdf(Vec3 center, Float radius) {
    return (2.0f * kInvFourPi) / max(sphere_cap(dot(center, center), radius), 1e-37f);
}

// Distance to a sphere along the unit vector w; negative for a miss.
EG_INLINE Float sphere_distance(Vec3 center, Float radius, Vec3 w) {
    const Float along = dot(center, w);
    const Vec3 across = center - w * along;
    const Float half2 = radius * radius - dot(across, across);
    const Float half = sqrt(max(half2, 0.0f));
    const Mask inside = dot(center, center) <= radius * radius;
    return select(half2 < 0.0f, splat(-1.0f), select(inside, along + half, along - half));
}

// Distance along a direction of the sphere's cone. Rounding may miss the sphere at its edge; then the nearest
// point is taken.
EG_INLINE Float distance_in_cone(Vec3 center, Float radius, Vec3 w) {
    const Float distance = sphere_distance(center, radius, w);
    return select(distance > 0.0f, distance, max(dot(center, w), 1e-30f));
}

EG_INLINE ShapeSample sample_sphere(Vec3 center, Float radius, Float u, Float v) {
    const SphereCone cone = sphere_cone(center, radius);
    const Vec3 w = sample_cone(cone.axis, cone.cap, u, v);
    return {w * distance_in_cone(center, radius, w), sphere_pdf(center, radius)};
}

EG_INLINE ShapeSample sample_facing_disk(Vec3 center, Float radius, Float u, Float v) {
    Vec3 a, b;
    const Vec3 axis = unit_vector(center);
    basis(axis, a, b);
    Float x, y;
    sample_disk(u, v, x, y);
    const Vec3 offset = center + a * (radius * x) + b * (radius * y);
    return {offset, area_pdf(offset, axis, radius * radius * 3.14159265f)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
