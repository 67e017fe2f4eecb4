// The motion of camera rays in boundary samples: with the requested parameters of the camera and, if the
// picture is warped (reparameterisation/picture_warp.h), with the fields about whose outlines it is.
#pragma once

#include "path/sample_blocks.h"
#include "reparameterisation/ray_search.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE bool rays_move(const DerivativeView& motion) { return motion.camera_requested || motion.warped; }

// Adds what a value of the derivatives (by_x, by_y) by the place in the picture changes, times the color.
EG_OUTLINE void warp_blocks(Forward& mode, Mask m, const Projection& view, Float by_x, Float by_y,
                            Vec3 color) {
    Float d = splat(0.0f);
    for (int i = 0; i < W; ++i)
        if (m[i])
            d[i] = warp_forward(
                warp_of_ray(mode.scene, picture_ray(mode.scene.camera, view.origin, view.direction, i)),
                mode.tangent.fields, by_x[i], by_y[i]);
    mode.value = mode.value + color * d;
}
EG_OUTLINE void warp_blocks(Backward& mode, Mask m, const Projection& view, Float by_x, Float by_y,
                            Vec3 color) {
    const Float a = dot(mode.adjoint, color);
    for (int i = 0; i < W; ++i)
        if (m[i] && a[i] != 0.0f)
            warp_backward(
                warp_of_ray(mode.scene, picture_ray(mode.scene.camera, view.origin, view.direction, i)),
                mode.gradient.fields, a[i] * by_x[i], a[i] * by_y[i]);
}

// Adds the velocity of the warped picture's ray at the point of `view`, dotted with g and times the color.
template <typename Mode>
EG_INLINE void warp_rays(Mode& mode, const SceneView& scene, Mask m, const Projection& view, Vec3 g,
                         Vec3 color) {
    const CameraView& c = scene.camera;
    const Float scale = (c.kind == kOrthographic ? splat(1.0f) : view.parameter) * (1.0f / c.focal);
    warp_blocks(mode, m, view, dot(g, splat3(c.right)) * scale,
                dot(g, splat3(c.up)) * scale * -c.pixel_aspect, color);
}

// The same for all motion of the camera's ray.
template <typename Mode>
EG_INLINE void camera_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion, Mask m,
                             const Projection& view, Vec3 g, Vec3 color) {
    if (motion.camera_requested) {
        Float row[kCameraFloats];
        ray_velocity_row(scene.camera, view, g, row);
        mode.camera(m, row, color);
    }
    if (motion.warped) warp_rays(mode, scene, m, view, g, color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
