// Pixel filters, sampled in proportion to their weight.
#pragma once

#include <vector>

#include "scene/view.h"

namespace edgegrad {

enum PixelFilter : int32_t { kBoxFilter, kBlackmanHarrisFilter, kGaussianFilter };

// Inverse of the cumulative distribution of the separable filter with the given full width (pixels). Entry k
// is the offset from the pixel's centre below which the fraction k / kFilterSize of the weight lies. Empty
// for the box of one pixel, whose sample is the random number itself.
std::vector<float> inverted_filter(PixelFilter filter, float width);

}  // namespace edgegrad
