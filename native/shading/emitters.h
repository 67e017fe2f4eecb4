// Sampling of finite emitters for the shadow boundary: emissive triangles, area lights' among them, point
// lights and suns without size. Points ride on their triangles at fixed barycentrics (material form), so they
// are sampled by area and by power, with a density that doesn't depend on the point they light; paths have
// samples by solid angle, and lights that are no triangles (shading/lights.h).
#pragma once

#include "sampling/sobol.h"
#include "scene/rays.h"

namespace edgegrad::EDGEGRAD_ISA {

// One emitter seen from a point x. The direct light that a surface there scatters is
//   f * radiance * geometry * (n . w) * V,
// where `geometry` holds everything but that cosine, divided by the probability of the sample:
//   triangle: |w . M| / (2 r^2 P)   (area measure; p = P / A, A = |M|/2, so |M| cancels)
//   point:    1 / (r^2 P)           (radiance is the intensity, W/sr)
//   sun:      1 / P                 (radiance is the irradiance)
struct EmitterSample {
    Mask active;  // on an emitting side
    Int kind, index;
    Vec3 w;   // unit, from x to the emitter
    Float r;  // distance; infinite for a sun
    Vec3 radiance;
    Float geometry;
    // Triangles only:
    Triangle triangle;
    Float b1, b2;
    Vec3 m;  // area normal on the emitting side, w . m < 0
};

// Last entry k with cdf[k] <= u.
EG_INLINE Int find_interval(const float* cdf, int count, Float u) {
    Int low = splat(0), high = splat(count);
    for (int size = count; size > 0; size >>= 1) {
        const Int mid = (low + high) >> 1;
        const Mask right = gather(cdf, mid) <= u;
        low = select(right, mid, low);
        high = select(right, high, mid);
    }
    return low;
}

// A sample of the finite emitters for any point of space.
EG_INLINE EmitterSample sample_emitter(const SceneView& scene, Mask active, Vec3 position, Float u, Float v) {
    EmitterSample s;
    const Int pick = find_interval(scene.emitter_cdf, scene.emitter_count, u);
    const Float low = gather(scene.emitter_cdf, pick), high = gather(scene.emitter_cdf, pick + 1);
    const Float probability = high - low;  // of picking this emitter
    // The place within the interval is a fresh uniform number: the pair's stratification serves
    // the choice of the emitter and the point on it alike.
    const Float u1 = min((u - low) / probability, splat(0.99999994f));
    s.kind = gather(scene.emitter_kind, pick);
    s.index = gather(scene.emitter_index, pick);

    const Mask is_triangle = s.kind == kEmissiveTriangle;
    const Mask is_sun = s.kind == kSunLight;
    const Mask is_point = s.kind == kPointLight;
    const Float root = sqrt(u1);
    s.b1 = root * (1.0f - v);
    s.b2 = root * v;
    const Int face = select(is_triangle, s.index, splat(0));
    Vec3 target = zero3();
    Int material = splat(0);
    s.m = zero3();
    s.triangle = {zero3(), zero3(), zero3()};
    if (any(is_triangle)) {
        s.triangle = gather_triangle(scene, face);
        target = interpolate(s.triangle, s.b1, s.b2);
        s.m = area_normal(s.triangle);
        material = gather(scene.face_material, face);
    }
    if (any(is_point))
        target = select(is_point, gather3(scene.point_position, select(is_point, s.index, splat(0))), target);

    const Vec3 d = target - position;
    const Float r2 = dot(d, d);
    s.r = sqrt(r2);
    s.w = d * (1.0f / max(s.r, 1e-30f));
    if (any(is_sun)) {
        const Vec3 travel = gather3(scene.sun_direction, select(is_sun, s.index, splat(0)));
        s.w = select(is_sun, -travel, s.w);
        s.r = select(is_sun, splat(__builtin_inff()), s.r);
    }
    Float geometry = select(is_sun, splat(1.0f), 1.0f / max(r2, 1e-30f));
    s.radiance = zero3();
    Mask emits = active;
    if (any(is_triangle)) {
        const Float facing = -dot(s.w, s.m);  // > 0: x sees the front
        const Mask two_sided = gather(scene.emission_two_sided, material) != 0;
        s.m = select(facing < 0.0f, -s.m, s.m);
        emits &= ~is_triangle | (facing > 0.0f) | (two_sided & (facing < 0.0f));
        geometry = select(is_triangle, geometry * abs(facing) * 0.5f, geometry);
        s.radiance = gather3(scene.emission, material);
    }
    if (any(is_point))
        s.radiance =
            select(is_point, gather3(scene.point_intensity, select(is_point, s.index, splat(0))), s.radiance);
    if (any(is_sun))
        s.radiance =
            select(is_sun, gather3(scene.sun_irradiance, select(is_sun, s.index, splat(0))), s.radiance);
    s.geometry = geometry / probability;
    s.active = emits;
    return s;
}

// The ray from `start`, off the surface of the point `x`, to the emitter: what it meets within `far` times
// its direction's length stands between.
struct ShadowRay {
    Vec3 direction;
    Float far;
};

EG_INLINE ShadowRay shadow_ray(Vec3 x, Vec3 start, const EmitterSample& s) {
    const Mask is_sun = s.kind == kSunLight;
    // The far end leaves its surface too: the ray stops short of the emitter's own triangle.
    Vec3 end = x + s.w * select(is_sun, splat(1.0f), s.r);
    const Mask is_triangle = s.kind == kEmissiveTriangle;
    if (any(is_triangle)) {
        const Float length = sqrt(dot(s.m, s.m));
        end = select(is_triangle, end + s.m * (ray_offset(s.triangle) / max(length, 1e-30f)), end);
    }
    return {select(is_sun, s.w, end - start), select(is_sun, splat(__builtin_inff()), 0.99999f)};
}

// Whether something stands between the point `x` and the emitter; rays start at `start`, off x's surface.
EG_INLINE Mask emitter_hidden(const SceneView& scene, Vec3 x, Vec3 start, const Ignored& ignored,
                              const EmitterSample& s) {
    const ShadowRay ray = shadow_ray(x, start, s);
    return occluded(scene, s.active, start, ray.direction, ray.far, ignored);
}

}  // namespace edgegrad::EDGEGRAD_ISA
