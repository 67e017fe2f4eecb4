// Fisheye lenses: the angle between a ray and the viewing direction is a function of the distance of its
// point of the picture from the principal point.
//
// With x and y in units of the focal length, y upwards, the radius is rho = sqrt(x^2 + y^2). The direction is
//   d = (x, y) sin(theta)/rho across the view, cos(theta) along it,
// where the angle theta(rho) grows with rho:
//   equisolid    theta = 2 asin(rho/2): equal areas of the picture show equal solid angles
//   others       theta = k0 + k1 rho + ... + k4 rho^4; equidistant: theta = rho.
// A pixel's solid angle is dx dy theta' sin(theta)/rho. Formulas as in Cycles (kernel/camera/projection.h).
#pragma once

#include "scene/geometry.h"
#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

// The angle at a radius, and its derivative.
struct FisheyeAngle {
    Float angle, slope;
};
EG_INLINE FisheyeAngle polynomial_angle(const CameraView& c, Float rho) {
    FisheyeAngle out{broadcast(&c.fisheye[4]), splat(0.0f)};
    for (int k = 3; k >= 0; --k) {
        out.slope = out.slope * rho + out.angle;
        out.angle = out.angle * rho + broadcast(&c.fisheye[k]);
    }
    return out;
}

// sin(theta)/rho and cos(theta) at a radius.
struct FisheyeDirection {
    Float across, along;
};
EG_INLINE FisheyeDirection fisheye_direction(const CameraView& c, Float rho) {
    if (c.kind == kEquisolidFisheye) {
        // By half angles, since sin(theta/2) = rho/2
        const Float square = min(rho * rho, splat(4.0f));
        return {sqrt(1.0f - 0.25f * square), 1.0f - 0.5f * square};
    }
    constexpr float kTurn = 0.159154943f;
    Float sine, cosine;
    sincos_turn(max(polynomial_angle(c, rho).angle, splat(0.0f)) * kTurn, sine, cosine);
    return {sine / rho, cosine};
}

// The radius at an angle, and the derivative of the angle there.
struct FisheyeRadius {
    Float rho, slope;
};
EG_INLINE FisheyeRadius fisheye_radius(const CameraView& c, Float sine, Float cosine) {
    if (c.kind == kEquisolidFisheye) {
        const Float rho = sqrt(max(2.0f - 2.0f * cosine, splat(0.0f)));
        // Near the viewing direction, 1 - cos(theta) rounds; its half angle's sine does not
        const Float near = sine / sqrt(max(0.5f + 0.5f * cosine, splat(1e-12f)));
        const Float exact = select(cosine > 0.0f, near, rho);
        return {exact, 1.0f / sqrt(max(1.0f - 0.25f * exact * exact, splat(1e-12f)))};
    }
    const Float angle = atan2(sine, cosine);
    if (c.kind == kEquidistantFisheye) return {angle, splat(1.0f)};
    // Halve the interval, then improve the result by Newton's method
    Float low = splat(0.0f), high = splat(c.disc / c.focal);
    const Float most = high;
    for (int k = 0; k < 8; ++k) {
        const Float middle = 0.5f * (low + high);
        const Mask below = polynomial_angle(c, middle).angle < angle;
        low = select(below, middle, low), high = select(below, high, middle);
    }
    Float rho = 0.5f * (low + high);
    for (int k = 0; k < 3; ++k) {
        const FisheyeAngle at = polynomial_angle(c, rho);
        rho = max(rho - (at.angle - angle) / max(at.slope, splat(1e-6f)), splat(0.0f));
    }
    const FisheyeAngle last = polynomial_angle(c, most);
    rho = select(angle > last.angle, 2.0f * most, rho);
    return {rho, polynomial_angle(c, rho).slope};
}

// Whether a fisheye's disc contains a point of the picture (pixels); other cameras see everywhere.
EG_INLINE Mask in_disc(const CameraView& c, Float sx, Float sy) {
    if (!is_fisheye(c.kind)) return splat(-1);
    const Float x = sx - c.principal[0], y = (sy - c.principal[1]) * c.pixel_aspect;
    return x * x + y * y <= c.disc * c.disc;
}

}  // namespace edgegrad::EDGEGRAD_ISA
