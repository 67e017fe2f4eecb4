// How many samples each part of the picture takes, given estimated variances of its pixels.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/image_tasks.h"

namespace edgegrad {

// Numbers of samples per pixel by chunk of the plan, for the least sum of variances in `budget` times the
// plan's time. `variance`: of one sample, by pixel, up to a common factor; `touched`: the part of a pixel's
// samples that has a derivative. Empty where so much would not be gained that it pays for the estimate.
std::vector<int32_t> distribute_samples(const ImagePlan& plan, const std::vector<double>& variance,
                                        const std::vector<double>& touched, double budget);

}  // namespace edgegrad
