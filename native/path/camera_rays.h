// Camera rays: from a point of the picture and a point of the lens to a ray in the scene.
#pragma once

#include "path/fisheye.h"
#include "scene/aperture.h"
#include "scene/geometry.h"
#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

// A ray. `direction` has unit depth for perspective and orthographic cameras, so that ray parameters are
// depths along the view axis. It has unit length for panoramas.
struct CameraRay {
    Vec3 origin, direction;
};

// Offset across the view axis of the picture point s (pixels, row 0 on top): at unit depth for a perspective
// camera, at any depth for an orthographic one.
EG_INLINE Vec3 across_view(const CameraView& c, Float sx, Float sy) {
    const Float inverse = 1.0f / broadcast(&c.focal);
    const Float x = (sx - broadcast(&c.principal[0])) * inverse;
    const Float y = (broadcast(&c.principal[1]) - sy) * (broadcast(&c.pixel_aspect) * inverse);
    return splat3(c.right) * x + splat3(c.up) * y;
}

// Direction of unit depth through the picture point s of a perspective camera.
EG_INLINE Vec3 camera_direction(const CameraView& c, Float sx, Float sy) {
    return across_view(c, sx, sy) - splat3(c.back);
}

// The mathematics of aperture_point() for packets.
struct ApertureMath {
    using Number = Float;
    EG_INLINE static Float read(const float* a) { return broadcast(a); }
    EG_INLINE static Float floor(Float a) { return EDGEGRAD_ISA::floor(a); }
    EG_INLINE static Float sqrt(Float a) { return EDGEGRAD_ISA::sqrt(a); }
    EG_INLINE static void turn(Float a, Float& sine, Float& cosine) { sincos_turn(a, sine, cosine); }
};
EG_INLINE void aperture_point(const CameraView& c, Float u, Float v, Float& x, Float& y) {
    edgegrad::aperture_point<ApertureMath>(c, u, v, x, y);
}

EG_INLINE CameraRay camera_ray(const CameraView& c, Float sx, Float sy, Float lens_u, Float lens_v) {
    CameraRay ray;
    ray.origin = splat3(c.position);
    if (c.kind == kEquirectangular) {
        const Float fx = (sx + static_cast<float>(c.window_x)) * (1.0f / static_cast<float>(c.full_width));
        const Float fy =
            1.0f - (sy + static_cast<float>(c.window_y)) * (1.0f / static_cast<float>(c.full_height));
        constexpr float kTurn = 0.159154943f;
        const auto turns = [](Float angle) {
            const Float t = angle * kTurn;
            return t - to_float(to_int(t)) + select(t < to_float(to_int(t)), splat(1.0f), 0.0f);
        };
        Float s, t, sine, cosine;
        const auto between = [&c](int edge, Float share) {
            const Float low = broadcast(&c.panorama[edge]), high = broadcast(&c.panorama[edge + 1]);
            return low + share * (high - low);
        };
        sincos_turn(turns(between(0, fx)), s, t);
        sincos_turn(turns(between(2, fy)), sine, cosine);
        ray.direction = splat3(c.right) * (s * cosine) + splat3(c.up) * sine - splat3(c.back) * (t * cosine);
        return ray;
    }
    if (is_fisheye(c.kind)) {
        const Float inverse = 1.0f / broadcast(&c.focal);
        const Float x = (sx - broadcast(&c.principal[0])) * inverse;
        const Float y = (broadcast(&c.principal[1]) - sy) * (broadcast(&c.pixel_aspect) * inverse);
        const FisheyeDirection d = fisheye_direction(c, sqrt(x * x + y * y + 1e-20f));
        ray.direction = (splat3(c.right) * x + splat3(c.up) * y) * d.across - splat3(c.back) * d.along;
        return ray;
    }
    if (c.kind == kOrthographic) {
        ray.origin = ray.origin + across_view(c, sx, sy);
        ray.direction = -splat3(c.back);
    } else {
        ray.direction = camera_direction(c, sx, sy);
    }
    if (c.aperture_radius > 0.0f) {
        // All rays of a picture point meet in the plane of focus.
        Float x, y;
        aperture_point(c, lens_u, lens_v, x, y);
        const Float radius = broadcast(&c.aperture_radius);
        const Vec3 lens = splat3(c.right) * (x * radius) + splat3(c.up) * (y * radius);
        ray.origin = ray.origin + lens;
        ray.direction = ray.direction - lens * (1.0f / broadcast(&c.focus_distance));
    }
    return ray;
}

// Offset of a sample from its pixel's corner, for the random number u.
EG_INLINE Float filter_sample(const CameraView& c, Float u) {
    if (!c.filter) return u;
    const Float place = u * static_cast<float>(kFilterSize);
    const Int cell = to_int(place);
    const Float low = gather(c.filter, cell), high = gather(c.filter, cell + 1);
    return low + (high - low) * (place - to_float(cell)) + 0.5f;
}

}  // namespace edgegrad::EDGEGRAD_ISA
