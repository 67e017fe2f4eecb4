// The arc in which the plane through a point x, with unit normal n, intersects a light: directions about n.
// Uniform samples of the arc have the density 1/angle.
#pragma once

#include "shading/lights/light_samples.h"

namespace edgegrad::EDGEGRAD_ISA {

// The point x, for the choice of a light. With this negative cosine, the bound of a light's irradiance
// (light_choice.h) is proportional to the sine by which the light's bounding sphere extends across the plane.
struct PlanePoint {
    Vec3 position, normal;

    EG_INLINE Float facing(Vec3 w) const { return -abs(dot(w, normal)); }
};

// The directions first cos(a) + (n x first) sin(a), a from 0 to `angle`, which may be negative.
struct Arc {
    Mask active;
    Vec3 first;
    Float angle;
};

// The arc between two points of the plane, relative to x.
EG_INLINE Arc arc_between(Mask active, Vec3 n, Vec3 p, Vec3 q) {
    p = p - n * dot(n, p);
    const Vec3 first = unit_vector(p);
    return {active, first, atan2(dot(cross(n, first), q), dot(first, q))};
}

// The arc of a convex polygon with corners relative to x.
template <int kCorners>
EG_INLINE Arc polygon_arc(Mask active, Vec3 n, const Vec3 (&corner)[kCorners]) {
    Vec3 end[2] = {zero3(), zero3()};
    Int found = splat(0);
    for (int k = 0; k < kCorners; ++k) {
        const Vec3 a = corner[k], b = corner[(k + 1) % kCorners];
        const Float above = dot(n, a), next = dot(n, b);
        const Mask cut = (above < 0.0f) != (next < 0.0f);
        const Float share = above / select(cut, above - next, 1.0f);
        const Vec3 at = a + (b - a) * share;
        end[0] = select(cut & (found == 0), at, end[0]);
        end[1] = select(cut & (found != 0), at, end[1]);
        found = found - cut;
    }
    return arc_between(active & (found >= 2), n, end[0], end[1]);
}

// The arc of an ellipse with the half axes x and y.
EG_INLINE Arc ellipse_arc(Mask active, Vec3 n, Vec3 center, Vec3 x, Vec3 y) {
    // n . (center + x s + y t) = 0 is a line in (s, t). Its chord in the unit disk is the cut.
    const Float a = dot(n, x), b = dot(n, y), c = dot(n, center), length2 = max(a * a + b * b, 1e-37f);
    const Float foot = -c / length2, half2 = 1.0f - c * c / length2;
    const Float half = sqrt(max(half2, 0.0f) / length2);
    const auto at = [&](Float along) {
        return center + x * (a * foot - b * along) + y * (b * foot + a * along);
    };
    return arc_between(active & (half2 > 0.0f), n, at(-half), at(half));
}

// The arc of a cone about `axis` (unit), with a half angle below pi/2.
EG_INLINE Arc cone_arc(Mask active, Vec3 n, Vec3 axis, Float sine2) {
    const Float height = dot(n, axis), level2 = max(1.0f - height * height, 1e-30f);
    const Float half2 = sine2 - height * height;  // level2 times the squared sine of half the arc
    const Float half = atan2(sqrt(max(half2, 0.0f)), sqrt(max(1.0f - sine2, 0.0f)));
    const Vec3 middle = (axis - n * height) * (1.0f / sqrt(level2));
    Float s, c;
    sincos(half, s, c);
    return {active & (half2 > 0.0f), middle * c - cross(n, middle) * s, 2.0f * half};
}

// All directions.
EG_INLINE Arc full_arc(Mask active, Vec3 n) {
    Vec3 a, b;
    basis(n, a, b);
    return {active, a, splat(6.28318531f)};
}

// The arc of a light of the table, and the distance of the light along a direction of the arc.
struct CutLight {
    LightRow light;
    Int kind;
    Vec3 center;  // the light's position relative to x
    Arc arc;

    EG_INLINE Float distance(Vec3 w) const {
        const auto is = [&](LightKind k) { return kind == splat(k); };
        const Mask flat = is(kRectangleLight) | is(kEllipseLight), disk = is(kDiskLight);
        const Vec3 normal = select(flat, light.direction, center);
        const Float way = dot(center, normal) / dot(w, normal);
        return select(flat | disk, way,
                      select(is(kSphereLight), sphere_distance(center, light.radius, w), splat(1.0f)));
    }
};

EG_INLINE CutLight cut_light(const LightView& lights, Mask active, Int row, Int kind, Vec3 x, Vec3 n) {
    CutLight cut{gather_light(lights, row), kind, zero3(), {splat(0), n, splat(0.0f)}};
    const LightRow& l = cut.light;
    cut.center = l.position - x;
    const Vec3 c = cut.center;
    const auto take = [&](LightKind k, const auto& arc_of) {
        const Mask here = active & (kind == splat(k));
        if (!(lights.kinds >> k & 1) || !any(here)) return;
        const Arc arc = arc_of(here);
        cut.arc.active |= arc.active;
        cut.arc.first = select(here, arc.first, cut.arc.first);
        cut.arc.angle = select(here, arc.angle, cut.arc.angle);
    };
    const Float d2 = max(dot(c, c), 1e-37f);
    take(kRectangleLight, [&](Mask here) {
        const Vec3 corner[4] = {c - l.axis_x - l.axis_y, c + l.axis_x - l.axis_y, c + l.axis_x + l.axis_y,
                                c - l.axis_x + l.axis_y};
        return polygon_arc(here & (dot(c, l.direction) < 0.0f), n, corner);
    });
    take(kEllipseLight, [&](Mask here) {
        return ellipse_arc(here & (dot(c, l.direction) < 0.0f), n, c, l.axis_x, l.axis_y);
    });
    take(kDiskLight, [&](Mask here) {
        Vec3 a, b;
        basis(c * (1.0f / sqrt(d2)), a, b);
        return ellipse_arc(here, n, c, a * l.radius, b * l.radius);
    });
    take(kSphereLight, [&](Mask here) {
        const Float sine2 = l.radius * l.radius / d2;
        const Mask inside = here & (sine2 >= 1.0f);
        Arc arc = cone_arc(here & ~inside, n, c * (1.0f / sqrt(d2)), sine2);
        if (any(inside)) {
            const Arc all = full_arc(inside, n);
            arc.active |= inside;
            arc.first = select(inside, all.first, arc.first);
            arc.angle = select(inside, all.angle, arc.angle);
        }
        return arc;
    });
    take(kConeLight, [&](Mask here) {
        return cone_arc(here, n, -l.direction, l.one_minus_cos * (2.0f - l.one_minus_cos));
    });
    return cut;
}

// Samples a light that the plane intersects, and a direction to it in the plane, with the random number u.
// The result is like other light samples (shading/lights/light_samples.h), but per angle about n. No plane
// intersects lights without size. `own` is the face that defines the plane.
EG_OUTLINE LightSample sample_light_arc(const SceneView& scene, Mask active, Vec3 x, Vec3 n, Int own,
                                        Float u) {
    const LightView& lights = scene.lights;
    // Choose a light
    const LightChoice choice = choose_light(lights, active, PlanePoint{x, n}, u);
    const Int index = gather(lights.index, choice.light), kind = gather(lights.kind, choice.light);
    const Mask is_triangle = choice.active & (kind == static_cast<int>(kTriangleLight));
    const Mask is_row = choice.active & ~is_triangle;
    LightSample s = no_light_sample(scene, is_triangle, is_row, index, kind);
    s.active = splat(0);
    s.distant = is_row & (kind >= static_cast<int>(kDirectionLight));
    s.pdf = splat(0.0f);
    s.w = n;
    s.r = splat(1.0f);
    s.end = x;
    Float angle = splat(0.0f);
    const auto direction = [&](const Arc& arc) {
        Float sine, cosine;
        sincos(arc.angle * choice.u, sine, cosine);
        s.active |= arc.active;
        angle = select(arc.active, arc.angle, angle);
        return arc.first * cosine + cross(n, arc.first) * sine;
    };
    // Sample the arc of an emissive triangle
    if (any(is_triangle)) {
        const Int face = select(is_triangle, index, splat(0)), material = gather(scene.face_material, face);
        Triangle t = gather_triangle(scene, face);
        const Float clearance = ray_offset(t);
        const Vec3 m = area_normal(t);
        t.p0 = t.p0 - x, t.p1 = t.p1 - x, t.p2 = t.p2 - x;
        const Mask front = dot(t.p0, m) < 0.0f;
        const Mask shines =
            is_triangle & (index != own) & (front | (gather(scene.emission_two_sided, material) != 0));
        const Vec3 corner[3] = {t.p0, t.p1, t.p2};
        const Vec3 w = direction(polygon_arc(shines, n, corner));
        s.w = select(is_triangle, w, s.w);
        s.r = select(is_triangle, dot(t.p0, m) / dot(w, m), s.r);
        barycentrics(t, w, s.b1, s.b2);
        s.radiance = select(is_triangle, gather3(scene.emission, material), s.radiance);
        const Float step = clearance / max(sqrt(dot(m, m)), 1e-30f);
        s.end = select(is_triangle, x + w * s.r + m * select(front, step, -step), s.end);
    }
    // Sample the arc of a light of the table
    if (any(is_row)) {
        const Int row = select(is_row, index, splat(0));
        const CutLight cut = cut_light(lights, is_row, row, kind, x, n);
        const Vec3 w = direction(cut.arc);
        s.w = select(is_row, w, s.w);
        s.r = select(is_row, select(s.distant, splat(__builtin_inff()), cut.distance(w)), s.r);
        s.end = select(is_row & ~s.distant, x + w * s.r, s.end);
        s.radiance = select(is_row, cut.light.radiance * light_factor(cut.light, w, s.r), s.radiance);
        take_links(lights, is_row, row, cut.light.flags, s);
    }
    s.active &= (s.r > 0.0f) & (angle != 0.0f);
    s.geometry = abs(angle) / max(choice.probability, 1e-37f);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
