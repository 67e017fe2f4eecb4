// An equirectangular image of the environment, and the distribution from which its directions are sampled.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/lights/environment_view.h"

namespace edgegrad {

class EnvironmentMap {
 public:
    // `pixels`: (height, width, 3) linear, row 0 on top.
    EnvironmentMap(const float* pixels, int32_t width, int32_t height);

    // A view of the map, which must outlive it.
    EnvironmentView view() const;

 private:
    int32_t width_, height_, columns_, rows_;
    std::vector<float> pixels_, sines_, rows_cdf_, columns_cdf_;
};

}  // namespace edgegrad
