#include "scene/lights/environment_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace edgegrad {
namespace {

// Small images are sampled on a finer grid than their pixels, because the radiance within a pixel is
// bilinear, not constant.
constexpr int32_t kLeastColumns = 256;

double luminance(const float* p) {
    return std::max(0.2126 * static_cast<double>(p[0]) + 0.7152 * static_cast<double>(p[1]) +
                        0.0722 * static_cast<double>(p[2]),
                    0.0);
}

// Row of an image whose rows wrap around at the poles, as the filter reads it (shading/lights/environment.h).
size_t wrapped(ptrdiff_t k, ptrdiff_t n) { return static_cast<size_t>((k % n + n) % n); }

// Weights of a pixel and its neighbours in the mean of the bilinear interpolant over one of `parts` equal
// parts of the pixel. For an even number of parts, none contains the pixel's centre, where the slope changes.
struct Taps {
    double before, here, after;
};
Taps part_taps(int32_t part, int32_t parts) {
    if (parts == 1) return {0.125, 0.75, 0.125};
    const double place = (part + 0.5) / parts - 0.5;
    return {std::max(-place, 0.0), 1.0 - std::abs(place), std::max(place, 0.0)};
}

// Cumulative sums of the weights divided by `all`; equal steps if all weights are zero.
void normalise(const std::vector<double>& weights, double all, float* cdf) {
    double sum = 0.0;
    const bool empty = !(all > 0.0);
    const double scale = 1.0 / (empty ? static_cast<double>(weights.size()) : all);
    for (size_t k = 0; k < weights.size(); ++k) {
        cdf[k] = static_cast<float>(sum * scale);
        sum += empty ? 1.0 : weights[k];
    }
    cdf[weights.size()] = 1.0f;
}

}  // namespace

EnvironmentMap::EnvironmentMap(const float* pixels, int32_t width, int32_t height)
    : width_(width), height_(height), pixels_(pixels, pixels + 3 * static_cast<size_t>(width) * height) {
    // Choose the sampling grid
    int32_t parts = 1;
    while (width * parts < kLeastColumns) parts *= 2;
    columns_ = width * parts;
    rows_ = height * parts;
    const auto w = static_cast<size_t>(width), h = static_cast<size_t>(height);
    const auto columns = static_cast<size_t>(columns_), rows = static_cast<size_t>(rows_);
    // Compute the luminance and its mean over the sphere
    std::vector<double> light(w * h);
    for (size_t k = 0; k < w * h; ++k) light[k] = luminance(pixels + 3 * k);
    sines_.resize(rows + 1);
    for (size_t r = 0; r <= rows; ++r)
        sines_[r] = static_cast<float>(
            std::cos(std::numbers::pi * static_cast<double>(r) / static_cast<double>(rows)));
    double mean = 0.0;
    for (size_t y = 0; y < h; ++y) {
        double row = 0.0;
        for (size_t x = 0; x < w; ++x) row += light[y * w + x];
        const double up = std::numbers::pi * static_cast<double>(y) / static_cast<double>(h);
        const double down = std::numbers::pi * static_cast<double>(y + 1) / static_cast<double>(h);
        mean += row / static_cast<double>(w) * 0.5 * (std::cos(up) - std::cos(down));
    }

    // Tabulate the distribution of cells by what exceeds `less`
    rows_cdf_.resize(rows + 1);
    columns_cdf_.resize(rows * (columns + 1));
    std::vector<double> line(w), cells(columns), row_weight(rows);
    const auto fill = [&](double less) {
        double all = 0.0;
        for (size_t r = 0; r < rows; ++r) {
            const auto y = static_cast<ptrdiff_t>(r) / parts;
            const Taps v = part_taps(static_cast<int32_t>(r) % parts, parts);
            const auto n = static_cast<ptrdiff_t>(h);
            const double* above = &light[w * wrapped(y - 1, n)];
            const double* here = &light[w * static_cast<size_t>(y)];
            const double* below = &light[w * wrapped(y + 1, n)];
            for (size_t x = 0; x < w; ++x)
                line[x] = v.before * above[x] + v.here * here[x] + v.after * below[x];
            double sum = 0.0;
            for (size_t c = 0; c < columns; ++c) {
                const size_t x = c / static_cast<size_t>(parts);
                const Taps u = part_taps(static_cast<int32_t>(c) % parts, parts);
                const double value = u.before * line[x ? x - 1 : w - 1] + u.here * line[x] +
                                     u.after * line[x + 1 < w ? x + 1 : 0];
                cells[c] = std::max(value - less, 0.0);
                sum += cells[c];
            }
            normalise(cells, sum, &columns_cdf_[r * (columns + 1)]);
            row_weight[r] = sum * static_cast<double>(sines_[r] - sines_[r + 1]);
            all += row_weight[r];
        }
        normalise(row_weight, all, rows_cdf_.data());
        return all;
    };
    // Leave directions below the mean to BSDF samples ("MIS compensation", Karlik et al. 2019). If almost
    // nothing exceeds the mean, sample the whole image.
    const double whole = mean * 2.0 * static_cast<double>(columns);
    if (!(fill(mean) > 0.01 * whole)) fill(0.0);
}

EnvironmentView EnvironmentMap::view() const {
    return {pixels_.data(),     width_, height_, true, columns_, rows_, sines_.data(), rows_cdf_.data(),
            columns_cdf_.data()};
}

}  // namespace edgegrad
