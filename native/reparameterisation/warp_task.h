// Samples of the warped picture (boundary/terms/warped_picture.h): paths within the bands about the outlines
// of distance fields, and what is known of each.
#pragma once

#include <cstdint>

#include "reparameterisation/picture_warp.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"

namespace edgegrad {

// By sample.
struct WarpSamples {
    float* weight;          // the area of the picture that it stands for; 0: none
    PictureWarp* warp;      // at its place, which is in the workspace's camera samples
    float* value[3];        // its radiance
    float* by_place[2][3];  // the derivatives of the radiance by the place in the picture
    // A point from which the filter's derivative is sampled: on the border of two pixels for the box filter,
    // else the sample itself. `axis`: across that border.
    int32_t* axis;
    float* border[2];
    PictureWarp* border_warp;
    float* border_value[3];
    float border_weight;  // of the filter's derivative by its two splats
    float border_step;    // from the border to each of them
};

struct WarpTask {
    BoundaryTask samples;
    ImageTask paths;
    WarpSamples of;
    // Radiance that is subtracted everywhere: since the warp vanishes at the border of its bands, a constant
    // contributes nothing but noise.
    float control[3];
};
// Splats of one sample: at its place, and on both sides of a border.
constexpr int32_t kWarpSplats = 4;

}  // namespace edgegrad
