// Light that arrives at a point: samples of all lights except the environment (shading/lights/environment.h),
// and their density where a ray meets a light by itself. The path tracer combines both by multiple importance
// sampling (Veach 1997).
#pragma once

#include "shading/lights/light_samples.h"
#include "shading/media.h"

namespace edgegrad::EDGEGRAD_ISA {

// Samples one light and a direction to it, for the point x. Lights that cannot contribute are inactive: those
// behind x, except in lanes of `both_sides`, and those whose limit is exceeded by the path's `bounces` before
// x. `shading`: as in Receiver.
[[maybe_unused]] EG_OUTLINE LightSample sample_light(const SceneView& scene, Mask active,
                                                     const SurfacePoint& x, Mask both_sides, Int bounces,
                                                     Float u, Float v, const Vec3* shading = nullptr) {
    const Float least_facing = select(x.face < 0, splat(1.0f), 0.0f);
    const SurfaceReceiver point{{x.position, x.normal, both_sides, shading, least_facing}, x.face};
    LightSample s = sample_light_for(scene, active, point, u, v);
    s.active &= shines_on(scene, s.row, x.mesh, bounces);
    return s;
}

// Solid-angle density of `sample_light` at `from` for the direction w, in which an emissive face is met at
// the distance r; 0 for faces that are not sampled.
[[maybe_unused]] EG_OUTLINE Float light_pdf(const SceneView& scene, Mask active, const Receiver& from,
                                            Int face, Vec3 w, Float r) {
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

// Visits all sized lights of the table that a ray of `kind` along w meets between the distances near and far
// from the surface point `from` that scattered it. Lights do not block the ray. Calls visit(row's number,
// mask, radiance, factor of the light's strength, distance); the factor is the power heuristic's weight
// against `sample_light` times what the light's shape leaves of it. `bsdf_pdf` 0: the ray has no density, so
// its weight is 1. `bounces` is the number before the surface that scattered the ray. `lobe`: as in
// share_of_row.
template <typename Visit>
EG_INLINE void for_each_light_along(const SceneView& scene, Mask active, const Receiver& from, Int from_mesh,
                                    Vec3 w, Float near, Float far, Float bsdf_pdf, Int kind, Int bounces,
                                    const RayLobe& lobe, const Visit& visit) {
    const LightView& lights = scene.lights;
    const auto add = [&](int row, Mask seen, const LightRow& l, Float distance, Float pdf) EG_INLINE_LAMBDA {
        Float weight = light_factor(l, w, distance);
        const Mask shared = seen & (bsdf_pdf > 0.0f);
        if (any(shared)) {
            const Float other =
                pdf * light_probability(lights, shared, from, splat(lights.light_of_row[row]));
            const Float p2 = bsdf_pdf * bsdf_pdf;
            weight = weight * select(shared, p2 / max(p2 + other * other, 1e-37f), 1.0f);
        }
        visit(row, seen, l.radiance, weight * share_of_row(scene, row, lobe), distance);
    };
    for_each_met_light(scene, active, from.position, from_mesh, w, near, far, kind, bounces, add);
}

// Sum of the radiance of these lights, of which media keep a part on the way from the distance `begin`.
[[maybe_unused]] EG_OUTLINE Vec3 lights_along(const SceneView& scene, Mask active, const Receiver& from,
                                              Int from_mesh, Vec3 w, Float near, Float far, Float bsdf_pdf,
                                              Int kind, Int bounces, const RayLobe& lobe = {},
                                              const Vec3* extinction = nullptr, Float begin = splat(0.0f)) {
    Vec3 sum = zero3();
    for_each_light_along(scene, active, from, from_mesh, w, near, far, bsdf_pdf, kind, bounces, lobe,
                         [&](int, Mask seen, Vec3 radiance, Float weight, Float distance) EG_INLINE_LAMBDA {
                             Vec3 light = radiance * weight;
                             if (extinction)
                                 light = light * kept_over(*extinction, max(distance - begin, 0.0f));
                             sum = sum + select(seen, light, zero3());
                         });
    return sum;
}

}  // namespace edgegrad::EDGEGRAD_ISA
