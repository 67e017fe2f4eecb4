#include "boundary/specular/scan_plan.h"

#include <algorithm>
#include <cmath>

#include "tasks/seed_tags.h"

namespace edgegrad {
namespace {

// The fraction of the lines that the first pass takes, and the weight of its estimate in the mean. The weight
// is small because the error of a line estimate falls at least with the square of the number of lines.
constexpr double kFirst = 0.25;
constexpr float kFirstWeight = 0.02f;
// About the largest number of lines in the first pass. By then each tile is known well enough, and all
// crossings of the first pass stay in memory until the second is planned.
constexpr double kMostFirst = 1 << 21;
// kAlike: the fraction of the second pass that is distributed evenly. A smaller one reduces the usual error
// but makes rare contributions, missed by the first pass, noisier. kLargest: upper bound of a tile's size
// relative to the mean; it limits the harm of outliers. kOwn: the weight of a tile relative to each of its
// eight neighbours, which the picture of the same edge may reach.
constexpr double kAlike = 0.5, kLargest = 16.0, kOwn = 4.0;

// A number of lines near `requested` that the pixels of a tile share evenly. Uneven numbers increase the
// variance along sharp edges several times (native/TUNING.md).
int32_t whole_lines(double requested) {
    constexpr double kPixels = kScanTile;
    if (requested < 0.75 * kPixels)
        return std::max(1, static_cast<int32_t>(std::lround(std::min(requested, 2.0))));
    return static_cast<int32_t>(kPixels * std::max(1.0, std::round(requested / kPixels)));
}

}  // namespace

ScanPlan::ScanPlan(const FilmRectangle& film, double lines, bool guided, uint32_t seed)
    : film_(film), guided_(guided), seed_(seed) {
    const auto tiles_along = [&](int axis) {
        return std::max(1, static_cast<int32_t>(std::ceil((film.high[axis] - film.low[axis]) / kScanTile)));
    };
    columns_ = tiles_along(0), rows_ = tiles_along(1);
    const double each = lines * kScanTile;
    const double first = std::min(kFirst * each, kMostFirst / (2.0 * static_cast<double>(tiles())));
    const std::vector<double> even(static_cast<size_t>(tiles()), guided ? first : each);
    set_lines(0, even);
    if (!guided) return;
    second_ = each - first;
    set_lines(1, std::vector<double>(even.size(), second_));
}

void ScanPlan::set_lines(int pass, const std::vector<double>& requested) {
    Pass& p = pass_[pass];
    p.lines.resize(requested.size());
    p.first.assign(1, 0);
    for (size_t k = 0; k < requested.size(); ++k) {
        p.lines[k] = whole_lines(requested[k]);
        p.first.push_back(p.first.back() + 2 * int64_t{kScanLine} * p.lines[k]);
    }
}

int64_t ScanPlan::total(int pass) const { return pass_[pass].first.back(); }

void ScanPlan::guide(const std::vector<std::vector<IntersectionSize>>& sizes) {
    // The estimate of a tile is a sum over lines, so sum the crossings of each line.
    std::vector<double> sums(static_cast<size_t>(total(0) / kScanLine), 0.0);
    for (const auto& part : sizes)
        for (const IntersectionSize& c : part)
            sums[static_cast<size_t>(c.line)] += static_cast<double>(c.size);
    std::vector<double> squares(static_cast<size_t>(tiles()), 0.0);
    size_t line = 0;
    for (size_t tile = 0; tile < squares.size(); ++tile)
        for (const size_t last = line + 2 * static_cast<size_t>(pass_[0].lines[tile]); line < last; ++line)
            squares[tile] += sums[line] * sums[line];
    // The optimal number of lines is proportional to the root of their mean square, estimated here from the
    // tile and its neighbours.
    std::vector<double> contribution(squares.size());
    double mean = 0.0;
    for (int32_t row = 0; row < rows_; ++row) {
        for (int32_t column = 0; column < columns_; ++column) {
            double sum = 0.0, count = 0.0;
            for (int32_t y = std::max(0, row - 1); y < std::min(rows_, row + 2); ++y) {
                for (int32_t x = std::max(0, column - 1); x < std::min(columns_, column + 2); ++x) {
                    const double part = x == column && y == row ? kOwn : 1.0;
                    sum += part * squares[static_cast<size_t>(y) * static_cast<size_t>(columns_) +
                                          static_cast<size_t>(x)];
                    count += part;
                }
            }
            mean += contribution[static_cast<size_t>(row) * static_cast<size_t>(columns_) +
                                 static_cast<size_t>(column)] = std::sqrt(sum / count);
        }
    }
    mean /= static_cast<double>(tiles());
    // Mix with an even distribution and scale to the number of lines
    double all = 0.0;
    for (double& w : contribution)
        all += w = kAlike + (1.0 - kAlike) * (mean > 0.0 ? std::min(w / mean, kLargest) : 1.0);
    for (double& w : contribution) w *= second_ * static_cast<double>(tiles()) / all;
    set_lines(1, contribution);
}

ScanTask ScanPlan::task(int pass, int64_t first, int64_t count) const {
    ScanTask t{};
    t.tile_first = pass_[pass].first.data();
    t.tile_lines = pass_[pass].lines.data();
    t.columns = columns_, t.rows = rows_;
    t.first = first, t.count = count;
    std::copy_n(film_.low, 2, t.low);
    std::copy_n(film_.high, 2, t.high);
    t.scale = !guided_ ? 1.0f : pass == 0 ? kFirstWeight : 1.0f - kFirstWeight;
    t.seed = seed_ ^ (pass == 0 ? 0u : kSecondPassSeed);
    return t;
}

}  // namespace edgegrad
