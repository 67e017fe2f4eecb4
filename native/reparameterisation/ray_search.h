// The search for near misses along the rays of a picture (reparameterisation/near_miss.h).
#pragma once

#include "path/camera_projection.h"
#include "reparameterisation/near_miss.h"
#include "reparameterisation/picture_warp.h"

namespace edgegrad::EDGEGRAD_ISA {

// Finds the near misses of a ray within their bands that no field hides, the nearest first. Returns their
// number. Fields without a band are left out. Minima nearer to a maximum than half a cell may be missed.
int find_near_misses(const SceneView& scene, const PictureRay& ray, NearMiss (&out)[kMostNearMisses]);

// The ray of one lane, whose direction has any length.
PictureRay picture_ray(const CameraView& camera, const float (&origin)[3], const float (&direction)[3]);

EG_INLINE PictureRay picture_ray(const CameraView& camera, Vec3 origin, Vec3 direction, int i) {
    return picture_ray(camera, {origin.x[i], origin.y[i], origin.z[i]},
                       {direction.x[i], direction.y[i], direction.z[i]});
}
inline PictureWarp warp_of_ray(const SceneView& scene, const PictureRay& ray) {
    NearMiss misses[kMostNearMisses];
    const int count = find_near_misses(scene, ray, misses);
    return count > 0 ? warp_of(misses, count) : PictureWarp{};
}

// For a value with the derivatives `slope` by the place in the picture: how it changes with the fields,
// times v, and the gradient of that.
float warp_forward(const PictureWarp& warp, const FieldDerivatives& fields, float by_x, float by_y);
void warp_backward(const PictureWarp& warp, const FieldDerivatives& fields, float by_x, float by_y);

}  // namespace edgegrad::EDGEGRAD_ISA
