// Values at places of the picture, which forward mode computes from boundary samples.
#pragma once

#include <cstdint>

namespace edgegrad {

// Forward mode: one value per boundary sample, at a place of the picture (x below kNowhere: at none).
constexpr float kNowhere = -1e9f;
struct Splats {
    float *x, *y;
    float* value[3];
};

}  // namespace edgegrad
