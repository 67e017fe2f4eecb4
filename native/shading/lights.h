// Light that reaches a point: samples of all lights but the environment (shading/environment.h), and the
// density of such samples where a ray meets a light by itself. What the path tracer combines by multiple
// importance sampling (Veach 1997).
#pragma once

#include "scene/rays.h"
#include "shading/light_choice.h"
#include "shading/light_rows.h"

namespace edgegrad::EDGEGRAD_ISA {

struct LightSample {
    Mask active;
    Vec3 w;          // unit, towards the light
    Float r;         // distance; infinite for suns
    Vec3 radiance;   // that arrives along w; of lights without size intensity or irradiance
    Float geometry;  // what radiance * f |cos| is multiplied with: 1/pdf, without size 1/(r^2 P) or 1/P
    Float pdf;       // per solid angle, choice included; 0: a light without size, no ray meets it
    Vec3 end;        // where the shadow ray ends: off the light's own surface
    Mask distant;
    Mask casts_shadow;
    Int blockers;    // what shadow rays meet: a mask for Embree
    Int visible_to;  // bits 1 << RayKind of the scattering that it lights surfaces through
    // Where it is a surface (its radiance is then that of a constant emission): face -1: it is none.
    Int face;
    Float b1, b2;
    Int row, kind;  // in the light table, -1: it is a surface; LightKind
};

// One light, and a direction to it, for the point x. Only what may light it is active: in front of it, unless
// `both_sides`, which say where light that falls on the back matters too.
EG_OUTLINE LightSample sample_light(const SceneView& scene, Mask active, const SurfacePoint& x,
                                    Mask both_sides, Float u, Float v) {
    const LightView& lights = scene.lights;
    const Receiver receiver{x.position, x.normal, both_sides};
    const LightChoice choice = choose_light(lights, active, receiver, u);
    LightSample s;
    s.active = choice.active;
    const Int kind = gather(lights.kind, choice.light), index = gather(lights.index, choice.light);
    const Mask is_triangle = s.active & (kind == static_cast<int>(kTriangleLight));
    s.distant = s.active & (kind >= static_cast<int>(kDirectionLight));
    const Mask is_row = s.active & ~is_triangle;
    s.radiance = zero3();
    s.casts_shadow = splat(-1);
    s.blockers = splat(1 << kShadowRay);
    s.visible_to = splat(-1);
    Vec3 offset{splat(0.0f), splat(0.0f), splat(1.0f)}, lift = zero3();
    Float density = splat(0.0f);
    Mask sized = is_triangle;
    s.face = select(is_triangle, index, splat(-1));
    s.row = select(is_row, index, splat(-1));
    s.kind = kind;
    s.b1 = s.b2 = splat(0.0f);

    if (any(is_triangle)) {
        const Int face = select(is_triangle, index, splat(0));
        Triangle t = gather_triangle(scene, face);
        const Float clearance = ray_offset(t);
        const Vec3 m = area_normal(t);
        t.p0 = t.p0 - x.position, t.p1 = t.p1 - x.position, t.p2 = t.p2 - x.position;
        const ShapeSample shape = sample_triangle_light(t, m, choice.u, v, s.b1, s.b2);
        const Mask front = dot(t.p0, m) < 0.0f;
        offset = select(is_triangle, shape.offset, offset);
        density = select(is_triangle, shape.pdf, density);
        const Int material = gather(scene.face_material, face);
        s.radiance = select(is_triangle, gather3(scene.emission, material), s.radiance);
        s.active &= ~is_triangle | front | (gather(scene.emission_two_sided, material) != 0);
        // A triangle doesn't light itself; rounding might find it a hemisphere around the point.
        s.active &= ~is_triangle | (index != x.face);
        const Float step = clearance / max(sqrt(dot(m, m)), 1e-30f);
        lift = select(is_triangle, m * select(front, step, -step), lift);
    }
    if (any(is_row)) {
        const Int row = select(is_row, index, splat(0));
        const LightRow l = gather_light(lights, row);
        const Vec3 center = l.position - x.position;
        const auto take = [&](Mask m, const ShapeSample& shape) {
            offset = select(m, shape.offset, offset);
            density = select(m, shape.pdf, density);
            sized |= m;
        };
        const auto is = [&](int k) { return is_row & (kind == k); };
        const auto occurs = [&](int k) { return (lights.kinds >> k & 1) && any(is(k)); };
        if (occurs(kPointSource)) offset = select(is(kPointSource), center, offset);
        if (occurs(kDirectionLight)) offset = select(is(kDirectionLight), -l.direction, offset);
        if (occurs(kSphereLight)) take(is(kSphereLight), sample_sphere(center, l.radius, choice.u, v));
        if (occurs(kDiskLight)) take(is(kDiskLight), sample_facing_disk(center, l.radius, choice.u, v));
        // Area lights shine to one side.
        const Mask flat = is(kRectangleLight) | is(kEllipseLight);
        if (any(flat)) {
            const AreaShape area = area_shape(l, x.position);
            const Mask spread = (l.flags & static_cast<int>(kLightSpread)) != 0;
            const Mask by_rectangle = is(kRectangleLight) | (flat & spread), by_area = flat & ~by_rectangle;
            s.active &= ~flat | ((dot(center, l.direction) < 0.0f) & (area.area > 0.0f));
            if (any(by_rectangle)) take(by_rectangle, sample_rectangle(area, choice.u, v));
            if (any(by_area)) take(by_area, sample_ellipse(area, choice.u, v));
            const Mask cut = is(kEllipseLight) & spread;
            if (any(cut)) s.active &= ~cut | within_ellipse(l, offset - center);
        }
        if (occurs(kConeLight))
            take(is(kConeLight), {sample_cone(-l.direction, l.one_minus_cos, choice.u, v), 1.0f / l.area});
        s.radiance = select(is_row, l.radiance, s.radiance);
        if (lights.any_linked) {
            const Int receivers = gather(lights.receivers, row), blockers = gather(lights.blockers, row);
            const Int sets = gather(scene.mesh_receivers, x.mesh);
            for (int i = 0; i < W; ++i) {
                if (!is_row[i]) continue;
                if (receivers[i] >= 0 && !(sets[i] >> receivers[i] & 1)) s.active[i] = 0;
                if (blockers[i] >= 0) s.blockers[i] = 1 << (kFirstBlockers + blockers[i]);
                if (!(l.flags[i] & kLightCastsShadow)) s.casts_shadow[i] = 0;
            }
        }
        if (lights.any_hidden) s.visible_to = select(is_row, gather(lights.visible_to, row), s.visible_to);
        const Float r = sqrt(max(dot(offset, offset), 1e-37f));
        const Float factor = light_factor(l, offset * (1.0f / r));
        s.radiance = select(is_row, s.radiance * factor, s.radiance);
    }

    const Float r2 = max(dot(offset, offset), 1e-37f);
    s.r = select(s.distant, splat(__builtin_inff()), sqrt(r2));
    s.w = select(s.distant, offset, offset * (1.0f / sqrt(r2)));
    s.end = x.position + offset + lift;
    s.pdf = select(sized, density * choice.probability, 0.0f);
    const Float flux = select(s.distant, choice.probability, choice.probability * r2);
    s.geometry = 1.0f / max(select(sized, s.pdf, flux), 1e-37f);
    // In the plane of an area light directions may have no end.
    s.active &= (both_sides | (dot(x.normal, s.w) > 0.0f)) & (r2 < 1e30f);
    if (!lights.dark_too) s.active &= largest_component(s.radiance) > 0.0f;
    return s;
}

// Solid-angle density with which `sample_light` from `from` finds the direction w, in which an emissive face
// is met at the distance r; 0 for faces that aren't sampled.
EG_OUTLINE Float light_pdf(const SceneView& scene, Mask active, const Receiver& from, Int face, Vec3 w,
                           Float r) {
    const LightView& lights = scene.lights;
    if (!lights.face_light) return splat(0.0f);
    const Int light = select(active, gather(lights.face_light, select(active, face, splat(0))), splat(-1));
    active &= light >= 0;
    if (!any(active)) return splat(0.0f);
    const Int at = select(active, face, splat(0));
    Triangle t = gather_triangle(scene, at);
    const Vec3 m = area_normal(t);
    t.p0 = t.p0 - from.position, t.p1 = t.p1 - from.position, t.p2 = t.p2 - from.position;
    const Float density = triangle_light_pdf(t, m, w * r);
    return select(active, density * light_probability(lights, active, from, select(active, light, splat(0))),
                  0.0f);
}

// Radiance of all sized lights of the table that a ray of `kind` along w meets between the distances near and
// far from the surface point `from` that scattered it (they don't block it), weighted by the power heuristic
// against `sample_light`; `bsdf_pdf` 0: the ray wasn't sampled by a density, all of it counts.
EG_OUTLINE Vec3 lights_along(const SceneView& scene, Mask active, const Receiver& from, Int from_mesh, Vec3 w,
                             Float near, Float far, Float bsdf_pdf, Int kind) {
    const LightView& lights = scene.lights;
    Vec3 sum = zero3();
    const auto add = [&](int row, Mask seen, const LightRow& l, Float pdf) EG_INLINE_LAMBDA {
        Float weight = light_factor(l, w);
        const Mask shared = seen & (bsdf_pdf > 0.0f);
        if (any(shared)) {
            const Float other =
                pdf * light_probability(lights, shared, from, splat(lights.light_of_row[row]));
            const Float p2 = bsdf_pdf * bsdf_pdf;
            weight = weight * select(shared, p2 / max(p2 + other * other, 1e-37f), 1.0f);
        }
        sum = sum + select(seen, l.radiance * weight, zero3());
    };
    for_each_met_light(scene, active, from.position, from_mesh, w, near, far, kind, add);
    return sum;
}

}  // namespace edgegrad::EDGEGRAD_ISA
