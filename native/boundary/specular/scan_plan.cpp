#include "boundary/specular/scan_plan.h"

#include <algorithm>
#include <cmath>

#include "tasks/seed_tags.h"

namespace edgegrad {
namespace {

// The fraction of the lines that the first pass takes. It only guides the second one: the error of a line
// estimate falls at least with the square of the number of lines, so that its own would add little.
constexpr double kFirst = 0.25;
// About the largest number of lines in the first pass. By then each tile is known well enough, and all
// crossings of the first pass stay in memory until the second is planned.
constexpr double kMostFirst = 1 << 21;
// Side of tiles, pixels: the smallest of which the first pass has a line in each direction, between these.
constexpr float kLeastTile = 1.0f, kMostTile = 4.0f;
// kAlike: the fraction of the second pass that is distributed evenly. A smaller one reduces the usual error
// but makes rare contributions, missed by the first pass, noisier. kLargest: upper bound of a pixel's size
// relative to the mean; it limits the harm of outliers. kOwn: the weight of a tile relative to each of its
// eight neighbours, which the picture of the same edge may reach.
constexpr double kAlike = 0.5, kLargest = 256.0, kOwn = 4.0;
// The part that follows the mean of wider surroundings, up to kWide pixels away: rough lobes scatter
// crossings, of which the first pass finds few in each tile.
constexpr double kAround = 0.5;
constexpr float kWide = 4.0f;

// For each tile the mean over a square of tiles, up to `radius` from it in each direction.
std::vector<double> means_around(const std::vector<double>& values, int32_t columns, int32_t rows,
                                 int32_t radius) {
    std::vector<double> out = values, sums;
    const auto blur = [&](int32_t count, int32_t lines, size_t step, size_t next) {
        sums.assign(static_cast<size_t>(count) + 1, 0.0);
        for (int32_t line = 0; line < lines; ++line) {
            double* at = out.data() + static_cast<size_t>(line) * next;
            for (int32_t k = 0; k < count; ++k)
                sums[static_cast<size_t>(k) + 1] =
                    sums[static_cast<size_t>(k)] + at[static_cast<size_t>(k) * step];
            for (int32_t k = 0; k < count; ++k) {
                const int32_t low = std::max(0, k - radius), high = std::min(count, k + radius + 1);
                at[static_cast<size_t>(k) * step] =
                    (sums[static_cast<size_t>(high)] - sums[static_cast<size_t>(low)]) / (high - low);
            }
        }
    };
    blur(columns, rows, 1, static_cast<size_t>(columns));
    blur(rows, columns, static_cast<size_t>(columns), 1);
    for (double& v : out) v = std::max(v, 0.0);  // differences of sums are rounded
    return out;
}

// Divides values by their mean, and limits them.
void limit_to_mean(std::vector<double>& values, double largest) {
    double mean = 0.0;
    for (const double v : values) mean += v / static_cast<double>(values.size());
    for (double& v : values) v = mean > 0.0 ? std::min(v / mean, largest) : 1.0;
}

float tile_side(const FilmRectangle& film, double lines) {
    const double pixels =
        static_cast<double>(film.high[0] - film.low[0]) * static_cast<double>(film.high[1] - film.low[1]);
    lines = std::min(lines, kMostFirst / (2.0 * pixels));
    float side = kLeastTile;
    while (side < kMostTile && lines * static_cast<double>(side) < 0.75) side *= 2.0f;
    return side;
}

}  // namespace

// A number of lines near `requested` that the pixels of a tile share evenly. Uneven numbers increase the
// variance along sharp edges several times (native/TUNING.md).
int32_t ScanPlan::whole_lines(double requested) const {
    const auto pixels = static_cast<double>(tile_);
    if (requested < 0.75 * pixels)
        return std::max(1, static_cast<int32_t>(std::lround(std::min(requested, 2.0))));
    return static_cast<int32_t>(pixels * std::max(1.0, std::round(requested / pixels)));
}

ScanPlan::ScanPlan(const FilmRectangle& film, double lines, bool guided, uint32_t seed)
    : film_(film), tile_(guided ? tile_side(film, kFirst * lines) : kMostTile), guided_(guided), seed_(seed) {
    const auto tiles_along = [&](int axis) {
        return std::max(1, static_cast<int32_t>(std::ceil((film.high[axis] - film.low[axis]) / tile_)));
    };
    columns_ = tiles_along(0), rows_ = tiles_along(1);
    const double each = lines * static_cast<double>(tile_);
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
        p.first.push_back(p.first.back() + 2 * int64_t{line_segments()} * p.lines[k]);
    }
}

int64_t ScanPlan::total(int pass) const { return pass_[pass].first.back(); }

void ScanPlan::guide(const std::vector<std::vector<IntersectionSize>>& sizes) {
    // The estimate of a tile is a sum over lines, so sum the crossings of each line.
    std::vector<double> sums(static_cast<size_t>(total(0) / line_segments()), 0.0);
    for (const auto& part : sizes)
        for (const IntersectionSize& c : part)
            sums[static_cast<size_t>(c.line)] += static_cast<double>(c.size);
    std::vector<double> squares(static_cast<size_t>(tiles()), 0.0);
    size_t line = 0;
    for (size_t tile = 0; tile < squares.size(); ++tile)
        for (const size_t last = line + 2 * static_cast<size_t>(pass_[0].lines[tile]); line < last; ++line)
            squares[tile] += sums[line] * sums[line];
    // The optimal number of lines is proportional to the root of their mean square, estimated here from the
    // tile and its neighbours, and from wider surroundings.
    const std::vector<double> near = means_around(squares, columns_, rows_, 1),
                              wide =
                                  means_around(squares, columns_, rows_, static_cast<int32_t>(kWide / tile_));
    std::vector<double> own(squares.size()), around(squares.size());
    for (size_t k = 0; k < squares.size(); ++k) {
        own[k] = std::sqrt(((kOwn - 1.0) * squares[k] + 9.0 * near[k]) / (kOwn + 8.0));
        around[k] = std::sqrt(wide[k]);
    }
    limit_to_mean(own, kLargest / static_cast<double>(tile_ * tile_));
    limit_to_mean(around, kLargest / static_cast<double>(tile_ * tile_));
    // Mix with an even distribution and scale to the number of lines
    std::vector<double> contribution(squares.size());
    double all = 0.0;
    for (size_t k = 0; k < squares.size(); ++k)
        all += contribution[k] = kAlike + (1.0 - kAlike) * (kAround * around[k] + (1.0 - kAround) * own[k]);
    for (double& w : contribution) w *= second_ * static_cast<double>(tiles()) / all;
    set_lines(1, contribution);
}

ScanTask ScanPlan::task(int pass, int64_t first, int64_t count) const {
    ScanTask t{};
    t.tile_first = pass_[pass].first.data();
    t.tile_lines = pass_[pass].lines.data();
    t.columns = columns_, t.rows = rows_, t.tile = tile_;
    t.guides = guided_ && pass == 0;
    t.first = first, t.count = count;
    std::copy_n(film_.low, 2, t.low);
    std::copy_n(film_.high, 2, t.high);
    t.seed = seed_ ^ (pass == 0 ? 0u : kSecondPassSeed);
    return t;
}

}  // namespace edgegrad
