// The inverse of camera rays: projects a point of the scene to the picture, and gives the Jacobian of this
// projection and the ray's motion with the camera.
//
// Let S(x) be the projection of a point x for a fixed point of the lens. S is constant along rays, so that DS
// depends only on the components across the ray. For any vectors v and w
//   det [DS v, DS w] = +-kappa (D x v) . w,
// where D is the direction of the ray through x. With x at the depth z or at the distance r (f pixels per
// unit, a the height of a pixel divided by its width), the kinds of cameras have
//   perspective      D = x - o,                 kappa = f^2 / (a z^3)
//   orthographic     D of unit depth,           kappa = f^2 / a
//   equirectangular  D = x - o,                 kappa = |W/dlon| |H/dlat| / (cos(lat) r^3)
//   fisheye          D = x - o,                 kappa = f^2 rho / (a sin(theta) theta'(rho) r^3)
// A lens of finite size does not change kappa. It moves o to the lens point o + l, l = lx X + ly Y, and all
// rays of a picture point meet in the plane of focus at the depth F. The projection of x to the plane at unit
// depth is
//   perspective:  (x.X - lx)/z + lx/F,     orthographic:  x.X - lx (1 - z/F)
// (and the same for Y): S is shifted, or sheared along D.
#pragma once

#include "path/camera_rays.h"
#include "scene/camera_row.h"
#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

// A point of the aperture, whose half width is 1 (`aperture_point`).
struct LensPoint {
    Float x, y;
};

struct Projection {
    Mask active;      // the point has a projection
    Float sx, sy;     // the projection in pixels, row 0 on top
    Vec3 origin;      // of the ray through it
    Vec3 direction;   // of that ray, unit
    Float distance;   // from the origin to the point
    Float near, far;  // clipping distances along the ray
    Vec3 across_of;   // D
    Float area;       // kappa
    Float x, y;       // of the ray: on the plane at unit depth, longitude and latitude, or path/fisheye.h
    Float parameter;  // depth z, or distance r
    LensPoint lens;
};

EG_INLINE Projection project(const CameraView& c, Vec3 point, LensPoint lens) {
    Projection s;
    s.lens = lens;
    const Vec3 right = splat3(c.right), up = splat3(c.up), back = splat3(c.back);
    const Vec3 p = point - splat3(c.position);
    const Float px = dot(right, p), py = dot(up, p), z = -dot(back, p);
    s.near = splat(c.clip_start);
    s.far = splat(c.clip_end);
    // Project to an equirectangular picture
    if (c.kind == kEquirectangular) {
        const Float r = sqrt(dot(p, p)), inverse = 1.0f / max(r, 1e-30f);
        s.active = r > 0.0f;
        s.origin = splat3(c.position);
        s.direction = p * inverse;
        s.distance = s.parameter = r;
        s.across_of = p;
        const float wide = c.panorama[1] - c.panorama[0], high = c.panorama[3] - c.panorama[2];
        s.x = atan2(px, z);
        s.y = asin(py * inverse);
        // Of the longitudes that differ by full turns, take the one nearest to the picture's centre.
        const float turn = 6.28318531f / wide;
        Float fx = (s.x - c.panorama[0]) * (1.0f / wide);
        fx = fx - turn * floor((fx - 0.5f) * (1.0f / turn) + 0.5f);
        const Float fy = (s.y - c.panorama[2]) * (1.0f / high);
        s.sx = fx * static_cast<float>(c.full_width) - static_cast<float>(c.window_x);
        s.sy = (1.0f - fy) * static_cast<float>(c.full_height) - static_cast<float>(c.window_y);
        const Float level = sqrt(px * px + z * z);  // r cos(lat)
        const float pixels = static_cast<float>(c.full_width) * static_cast<float>(c.full_height);
        s.area = splat(__builtin_fabsf(pixels / (wide * high))) / max(level * r * r, 1e-30f);
        return s;
    }
    // Project to a fisheye's picture
    if (is_fisheye(c.kind)) {
        const Float level = sqrt(px * px + py * py), r = sqrt(level * level + z * z);
        const Float inverse = 1.0f / max(r, 1e-30f);
        const FisheyeRadius at = fisheye_radius(c, level * inverse, z * inverse);
        s.origin = splat3(c.position);
        s.direction = p * inverse;
        s.distance = s.parameter = r;
        s.across_of = p;
        // rho / sin(theta), whose limit at the principal point is 1 / theta'
        const Float per_sine = select(level > 1e-6f * r, at.rho * r / max(level, 1e-30f), 1.0f / at.slope);
        s.x = px * inverse * per_sine;
        s.y = py * inverse * per_sine;
        s.sx = c.principal[0] + c.focal * s.x;
        s.sy = c.principal[1] - (c.focal / c.pixel_aspect) * s.y;
        s.active = (r > 0.0f) & in_disc(c, s.sx, s.sy);
        s.area = (c.focal * c.focal / c.pixel_aspect) * per_sine * inverse * inverse * inverse / at.slope;
        return s;
    }
    // Project to the plane at unit depth of a perspective or orthographic camera
    const Float lx = lens.x * c.aperture_radius, ly = lens.y * c.aperture_radius;
    const Float blur = c.aperture_radius > 0.0f ? z * (1.0f / c.focus_distance) : splat(0.0f);  // z / F
    s.active = z > 0.0f;
    s.parameter = z;
    const float scale = c.focal * c.focal / c.pixel_aspect;
    if (c.kind == kOrthographic) {
        s.x = px - lx * (1.0f - blur);
        s.y = py - ly * (1.0f - blur);
        s.origin = splat3(c.position) + right * (s.x + lx) + up * (s.y + ly);
        s.area = splat(scale);
    } else {
        const Float inverse = 1.0f / select(s.active, z, 1.0f);
        s.x = (px - lx * (1.0f - blur)) * inverse;
        s.y = (py - ly * (1.0f - blur)) * inverse;
        s.origin = splat3(c.position) + right * lx + up * ly;
        s.area = scale * inverse * inverse * inverse;
    }
    // Convert to pixels, and clipping depths to distances along the ray
    s.sx = c.principal[0] + c.focal * s.x;
    s.sy = c.principal[1] - (c.focal / c.pixel_aspect) * s.y;
    const Vec3 way = point - s.origin;
    s.distance = sqrt(dot(way, way));
    s.direction = way * (1.0f / max(s.distance, 1e-30f));
    const Float per_depth = s.distance / select(s.active, z, 1.0f);
    s.near = s.near * per_depth;
    s.far = s.far * per_depth;
    s.across_of = c.kind == kOrthographic ? s.direction * per_depth : way;
    return s;
}

// Derivative of g . x with respect to each float of the camera. x stays at fixed picture coordinates, at a
// fixed depth and at a fixed point of the aperture. This is the transpose of the ray's velocity.
EG_INLINE void ray_velocity_row(const CameraView& c, const Projection& s, Vec3 g, Float row[kCameraFloats]) {
    for (int k = 0; k < kCameraFloats; ++k) row[k] = splat(0.0f);
    const auto put = [&](int place, Vec3 v) { row[place] = v.x, row[place + 1] = v.y, row[place + 2] = v.z; };
    const Float across = dot(g, splat3(c.right)), along = dot(g, splat3(c.up)), z = s.parameter;
    // Position
    put(kCameraPosition, g);
    if (c.kind == kEquirectangular) {
        // The direction is X sin(x) cos(y) + Y sin(y) - Z cos(x) cos(y).
        Float sx, cx, sy, cy;
        sincos(s.x, sx, cx);
        sincos(s.y, sy, cy);
        const Float away = dot(g, splat3(c.back));
        put(kCameraRight, g * (z * sx * cy));
        put(kCameraUp, g * (z * sy));
        put(kCameraBack, -(g * (z * cx * cy)));
        const Float by_x = z * cy * (across * cx + away * sx);
        const Float by_y = z * (along * cy - sy * (across * sx - away * cx));
        const Float fx = (s.sx + static_cast<float>(c.window_x)) * (1.0f / static_cast<float>(c.full_width));
        const Float fy =
            1.0f - (s.sy + static_cast<float>(c.window_y)) * (1.0f / static_cast<float>(c.full_height));
        row[kCameraPanorama] = by_x * (1.0f - fx);
        row[kCameraPanorama + 1] = by_x * fx;
        row[kCameraPanorama + 2] = by_y * (1.0f - fy);
        row[kCameraPanorama + 3] = by_y * fy;
        return;
    }
    if (is_fisheye(c.kind)) {
        // The direction is (X x + Y y) sin(theta)/rho - Z cos(theta).
        const Float rho = sqrt(s.x * s.x + s.y * s.y + 1e-20f);
        const FisheyeDirection d = fisheye_direction(c, rho);
        const Float cosine = s.x / rho, sine = s.y / rho;  // of the turn about the viewing direction
        put(kCameraRight, g * (z * d.across * s.x));
        put(kCameraUp, g * (z * d.across * s.y));
        put(kCameraBack, -(g * (z * d.along)));
        const Float away = dot(g, splat3(c.back));
        const Float by_angle = z * (d.along * (across * cosine + along * sine) + away * d.across * rho);
        const Float slope = fisheye_radius(c, d.across * rho, d.along).slope;
        const Float by_rho = by_angle * slope, by_turn = z * d.across * (along * cosine - across * sine);
        const Float by_x = by_rho * cosine - by_turn * sine, by_y = by_rho * sine + by_turn * cosine;
        row[kCameraFocal] = by_rho * rho * (-1.0f / c.focal);
        row[kCameraPixelAspect] = by_y * s.y * (1.0f / c.pixel_aspect);
        row[kCameraPrincipal] = by_x * (-1.0f / c.focal);
        row[kCameraPrincipal + 1] = by_y * (c.pixel_aspect / c.focal);
        if (c.kind == kEquisolidFisheye) return;
        Float power = by_angle;
        for (int k = 0; k < 5; ++k) {
            row[kCameraFisheye + k] = power;
            power = power * rho;
        }
        return;
    }
    // x is at o + X (m x + lx k) + Y (m y + ly k) - Z z, with k = 1 - z/F; m = z or, orthographic, 1.
    const Float m = c.kind == kOrthographic ? splat(1.0f) : z;
    const float radius = c.aperture_radius;
    const Float k = radius > 0.0f ? 1.0f - z * (1.0f / c.focus_distance) : splat(1.0f);
    const Float lx = s.lens.x * radius, ly = s.lens.y * radius;
    // Axes, focal length and principal point of a perspective or orthographic camera
    put(kCameraRight, g * (m * s.x + lx * k));
    put(kCameraUp, g * (m * s.y + ly * k));
    put(kCameraBack, -(g * z));
    row[kCameraFocal] = m * (across * s.x + along * s.y) * (-1.0f / c.focal);
    row[kCameraPixelAspect] = m * along * s.y * (1.0f / c.pixel_aspect);
    row[kCameraPrincipal] = m * across * (-1.0f / c.focal);
    row[kCameraPrincipal + 1] = m * along * (c.pixel_aspect / c.focal);
    // Aperture
    if (radius > 0.0f) {
        row[kCameraApertureRadius] = k * (across * s.lens.x + along * s.lens.y);
        row[kCameraFocusDistance] =
            z * (across * lx + along * ly) * (1.0f / (c.focus_distance * c.focus_distance));
        row[kCameraApertureRatio] = k * across * lx * (-1.0f / c.aperture_ratio);
        if (c.aperture_blades >= 3)  // a round aperture has no orientation
            row[kCameraApertureRotation] =
                k * (along * lx * c.aperture_ratio - across * ly * (1.0f / c.aperture_ratio));
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
