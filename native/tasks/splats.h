// Values of boundary samples at places of the picture, in forward mode.
#pragma once

namespace edgegrad {

// One value and place per boundary sample. If x is below kNowhere the sample has no place.
constexpr float kNowhere = -1e9f;
struct Splats {
    float *x, *y;
    float* value[3];
};

}  // namespace edgegrad
