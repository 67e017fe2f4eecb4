#include "film/pixel_filter.h"

#include <cmath>
#include <numbers>

namespace edgegrad {
namespace {

// Weight at offset x, as in Cycles: the Blackman-Harris window over [-width/2, width/2], or exp(-2 (6 x /
// width)^2), truncated to the same interval.
double weight(PixelFilter filter, double x, double width) {
    if (filter == kBlackmanHarrisFilter) {
        const double v = 2.0 * std::numbers::pi * (x / width + 0.5);
        return 0.35875 - 0.48829 * std::cos(v) + 0.14128 * std::cos(2.0 * v) - 0.01168 * std::cos(3.0 * v);
    }
    if (filter == kGaussianFilter) {
        const double v = 6.0 * x / width;
        return std::exp(-2.0 * v * v);
    }
    return 1.0;
}

}  // namespace

std::vector<float> inverted_filter(PixelFilter filter, float width) {
    if (filter == kBoxFilter && width == 1.0f) return {};
    constexpr int kSteps = 16 * kFilterSize;
    const double half = 0.5 * static_cast<double>(width), step = 2.0 * half / kSteps;
    std::vector<double> sum{0.0};
    for (int k = 0; k < kSteps; ++k)
        sum.push_back(sum.back() + weight(filter, -half + (k + 0.5) * step, static_cast<double>(width)));
    std::vector<float> offsets;
    size_t at = 0;
    for (int k = 0; k <= kFilterSize; ++k) {
        const double requested = sum.back() * k / kFilterSize;
        while (at + 2 < sum.size() && sum[at + 1] < requested) ++at;
        const double cell = sum[at + 1] - sum[at];
        const double within = cell > 0.0 ? (requested - sum[at]) / cell : 0.0;
        offsets.push_back(static_cast<float>(-half + (static_cast<double>(at) + within) * step));
    }
    return offsets;
}

}  // namespace edgegrad
