// Radiance of the environment by direction.
#pragma once

#include "scene/view.h"
#include "simd/elementary.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

constexpr float kHalfInvPi = 0.159154943f;

EG_INLINE Vec3 rotated(const float* m, Vec3 v) {
    return {dot(splat3(m), v), dot(splat3(m + 3), v), dot(splat3(m + 6), v)};
}
EG_INLINE Vec3 rotated_back(const float* m, Vec3 v) {
    return splat3(m) * v.x + splat3(m + 3) * v.y + splat3(m + 6) * v.z;
}

// Image coordinates of a direction, u to the right and v from the top, both in [0, 1].
EG_INLINE void environment_place(const SceneView& scene, Vec3 w, Float& u, Float& v) {
    const Vec3 d = rotated(scene.environment_rotation, w);
    u = 0.5f - atan2(d.y, d.x) * kHalfInvPi;
    // At the poles atan2 is accurate, where asin is not.
    v = atan2(sqrt(d.x * d.x + d.y * d.y), d.z) * (2.0f * kHalfInvPi);
}

// Bilinear interpolation. Columns and rows wrap around at the edges (Cycles' Repeat).
EG_INLINE Vec3 filter_environment(const EnvironmentView& map, Float u, Float v) {
    const Float x = u * static_cast<float>(map.width) - 0.5f, y = v * static_cast<float>(map.height) - 0.5f;
    const Float left = floor(x), top = floor(y);
    const Float fx = x - left, fy = y - top;
    // Directions that are not finite must still give a valid index.
    Int x0 = to_index(left, -1, map.width), y0 = to_index(top, -1, map.height);
    x0 = select(x0 < 0, x0 + map.width, x0);
    y0 = select(y0 < 0, y0 + map.height, y0);
    x0 = select(x0 >= map.width, splat(0), x0);
    y0 = select(y0 >= map.height, splat(0), y0);
    const Int x1 = select(x0 + 1 >= map.width, splat(0), x0 + 1);
    const Int y1 = select(y0 + 1 >= map.height, splat(0), y0 + 1);
    const auto pixel = [&](Int column, Int row) { return gather3(map.pixels, row * map.width + column); };
    const Vec3 upper = pixel(x0, y0) * (1.0f - fx) + pixel(x1, y0) * fx;
    const Vec3 lower = pixel(x0, y1) * (1.0f - fx) + pixel(x1, y1) * fx;
    return upper * (1.0f - fy) + lower * fy;
}

// Factor of the environment's colour in the direction w.
EG_INLINE Vec3 environment_gain(const SceneView& scene, Vec3 w) {
    if (!scene.environment_image.pixels) return one3();
    Float u, v;
    environment_place(scene, w, u, v);
    return filter_environment(scene.environment_image, u, v);
}

// Radiance from the direction w, for ray kinds that see the environment.
EG_INLINE Vec3 environment_radiance(const SceneView& scene, Vec3 w) {
    const Vec3 color = splat3(scene.environment);
    return scene.environment_image.pixels ? color * environment_gain(scene, w) : color;
}

// The meshes that block light of the environment: shadow rays test for samples of its image; without an image
// that is sampled, scattered rays find it.
EG_INLINE Int environment_blockers(const SceneView& scene) {
    return splat(scene.environment_image.sampled ? 1 << kShadowRay : 1 << kDiffuseRay);
}
// Lanes whose light turns with the environment: all, or none if its radiance is the same in all directions.
EG_INLINE Mask turns_with_environment(const SceneView& scene) {
    return splat(scene.environment_image.pixels ? -1 : 0);
}

}  // namespace edgegrad::EDGEGRAD_ISA
