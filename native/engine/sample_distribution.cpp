#include "engine/sample_distribution.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

// The fewest and the most samples of a pixel, relative to the mean. The fewest limit the noise of pixels
// whose rare large samples the estimate has not seen.
constexpr double kFewest = 0.5, kMost = 8.0;
// Part of a pixel's variance that is its own; the rest is the mean of it and its neighbours.
constexpr double kOwn = 0.5;
// Of the picture's mean variance, this much is added to each pixel's.
constexpr double kFloor = 1e-3;
// Time of a sample without a derivative, relative to one that has one: nothing is swept.
constexpr double kEmpty = 0.1;
// The variance that is expected must fall below this part.
constexpr double kWorthwhile = 0.8;

// The variances, each partly replaced by the mean over 3 x 3 pixels: an estimate from few samples misses
// large ones that its neighbours have seen.
std::vector<double> smoothed(const std::vector<double>& variance, int64_t width) {
    const int64_t height = static_cast<int64_t>(variance.size()) / width;
    double mean = 0.0;
    for (double v : variance) mean += v;
    mean /= static_cast<double>(variance.size());
    std::vector<double> out(variance.size());
    for (int64_t y = 0; y < height; ++y)
        for (int64_t x = 0; x < width; ++x) {
            double sum = 0.0, count = 0.0;
            for (int64_t j = std::max<int64_t>(y - 1, 0); j < std::min(y + 2, height); ++j)
                for (int64_t i = std::max<int64_t>(x - 1, 0); i < std::min(x + 2, width); ++i)
                    sum += variance[static_cast<size_t>(j * width + i)], count += 1.0;
            const auto k = static_cast<size_t>(y * width + x);
            out[k] = kOwn * variance[k] + (1.0 - kOwn) * sum / count + kFloor * mean;
        }
    return out;
}

}  // namespace

std::vector<int32_t> distribute_samples(const ImagePlan& plan, const std::vector<double>& variance,
                                        const std::vector<double>& touched, double budget) {
    const std::vector<double> pixels = smoothed(variance, plan.camera.width);
    const auto chunks = static_cast<size_t>(plan.chunks);
    std::vector<double> sums(chunks, 0.0), times(chunks, 0.0);
    for (size_t k = 0; k < pixels.size(); ++k) {
        const size_t chunk = k / static_cast<size_t>(plan.per_chunk);
        sums[chunk] += pixels[k], times[chunk] += kEmpty + (1.0 - kEmpty) * touched[k];
    }
    // Numbers are powers of two times the fewest, for which Sobol' points are distributed best
    const auto share = [&](size_t chunk, double scale) {
        const double exact = std::sqrt(sums[chunk] / times[chunk]) * scale;
        return std::clamp(std::exp2(std::round(std::log2(std::max(exact, 1e-300)))), kFewest, kMost);
    };
    const auto total = [&](double scale) {
        double sum = 0.0;
        for (size_t k = 0; k < chunks; ++k) sum += times[k] * share(k, scale);
        return sum;
    };
    double all = 0.0, time = 0.0;
    for (double s : sums) all += s;
    for (double t : times) time += t;
    const double most = budget * time;
    if (!(all > 0.0) || !std::isfinite(all)) return {};
    // Find the largest scale within the budget
    const double middle = std::sqrt(time / all);
    double low = -40.0, high = 40.0;
    for (int step = 0; step < 40; ++step) {
        const double half = 0.5 * (low + high);
        (total(middle * std::exp2(half)) > most ? high : low) = half;
    }
    const double scale = middle * std::exp2(low);
    double expected = 0.0;
    for (size_t k = 0; k < chunks; ++k) expected += sums[k] / share(k, scale);
    if (!(expected < kWorthwhile * all)) return {};
    std::vector<int32_t> out(chunks);
    for (size_t k = 0; k < chunks; ++k)  // even, for pairs
        out[k] =
            2 * std::max(1, static_cast<int32_t>(std::lround(0.5 * plan.options.samples * share(k, scale))));
    return out;
}

}  // namespace edgegrad
