#include "boundary/samples/beam_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "util/parallel.h"

namespace edgegrad {
namespace {

// Cells along the longest side of the grid.
constexpr double kCells = 32.0;
// The least width of directions to a target, 1 - cos.
constexpr double kLeastWidth = 1e-7;
// Directions of beams are sampled in cells where they fill a smaller solid angle.
constexpr double kWide = 0.3;

// A number in (0, 1) for each beam and cell, by a hash (lowbias32).
double random_number(size_t beam, size_t cell) {
    auto x = static_cast<uint32_t>(beam * 0x9e3779b9u + cell * 0x85ebca6bu);
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return (static_cast<double>(x ^ (x >> 16)) + 0.5) * 0x1p-32;
}

// 1 - cos of the angle between two unit vectors.
double apart(Vector a, Vector b) {
    const Vector d = a - b;
    return 0.5 * dot(d, d);
}

Vector direction(Vector from, Vector to) {
    const Vector way = to - from;
    return way * (1.0 / std::max(length(way), 1e-30));
}

}  // namespace

// Places the grid about most ends of beams.
void BeamGridBuilder::place() {
    constexpr double kOutside = 0.02, kMargin = 0.25;
    std::array<double, 3> size{};
    double longest = 0.0;
    for (size_t axis = 0; axis < 3; ++axis) {
        std::vector<double> x;
        const auto add = [&](Vector p) { x.push_back(axis == 0 ? p.x : axis == 1 ? p.y : p.z); };
        for (const Beam& b : beams_) {
            add(b.last), add(b.first), add(b.end);
            if (!b.is_distant()) add(b.light);
        }
        const auto outside = static_cast<ptrdiff_t>(kOutside * static_cast<double>(x.size() - 1));
        const auto nth = [&](ptrdiff_t n) {
            std::nth_element(x.begin(), x.begin() + n, x.end());
            return x[static_cast<size_t>(n)];
        };
        const double low = nth(outside), high = nth(static_cast<ptrdiff_t>(x.size()) - 1 - outside);
        grid_.low_[axis] = low - kMargin * (high - low);
        size[axis] = (1.0 + 2.0 * kMargin) * (high - low);
        longest = std::max(longest, size[axis]);
    }
    grid_.side_ = std::max(longest, 1e-30) / kCells;
    for (size_t axis = 0; axis < 3; ++axis) {
        grid_.count_[axis] = std::max(1, static_cast<int32_t>(std::ceil(size[axis] / grid_.side_)));
        grid_.low_[axis] -= 0.5 * (grid_.count_[axis] * grid_.side_ - size[axis]);
    }
    const auto cells = static_cast<size_t>(grid_.count_[0]) * static_cast<size_t>(grid_.count_[1]) *
                       static_cast<size_t>(grid_.count_[2]);
    grid_.slot_.assign(cells, -1);
    marked_.assign(cells, 0);
}

Vector BeamGridBuilder::middle(size_t cell) const {
    double at[3];
    for (size_t k = 0; k < 3; ++k) {
        const auto along = static_cast<size_t>(grid_.count_[k]);
        at[k] = grid_.low_[k] + (static_cast<double>(cell % along) + 0.5) * grid_.side_;
        cell /= along;
    }
    return {at[0], at[1], at[2]};
}

// Calls visit(cell) for each cell that the segment from a to b passes, but for corners that it clips.
void BeamGridBuilder::visit_cells(Vector a, Vector b, const std::function<void(size_t)>& visit) const {
    const double start[3] = {a.x, a.y, a.z}, way[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
    double near = 0.0, far = 1.0, longest = 0.0;
    for (size_t k = 0; k < 3; ++k) {
        const double high = grid_.low_[k] + grid_.count_[k] * grid_.side_;
        longest = std::max(longest, std::abs(way[k]));
        if (std::abs(way[k]) < 1e-30) {
            if (start[k] < grid_.low_[k] || start[k] > high) return;
            continue;
        }
        const double p = (grid_.low_[k] - start[k]) / way[k], q = (high - start[k]) / way[k];
        near = std::max(near, std::min(p, q)), far = std::min(far, std::max(p, q));
    }
    if (!(near < far)) return;
    const double step = 0.5 * grid_.side_ / std::max(longest, 1e-30);
    int64_t before = -1;
    for (double t = near + 0.5 * std::min(step, far - near); t < far; t += step) {
        int64_t cell = 0;
        for (size_t k = 3; k-- > 0;) {
            const auto i = static_cast<int64_t>((start[k] + t * way[k] - grid_.low_[k]) / grid_.side_);
            cell = cell * grid_.count_[k] + std::clamp<int64_t>(i, 0, grid_.count_[k] - 1);
        }
        if (cell != before) visit(static_cast<size_t>(cell));
        before = cell;
    }
}

// Keeps the beams with the smallest keys: a random choice by weight (Efraimidis and Spirakis 2006).
void BeamGridBuilder::keep(Kept& cell, double key, int32_t beam) {
    if (cell.count < kBeamTargets) {
        cell.key[cell.count] = key, cell.beam[cell.count++] = beam;
        return;
    }
    double* last = std::max_element(cell.key, cell.key + kBeamTargets);
    if (key < *last) cell.beam[last - cell.key] = beam, *last = key;
}

// Writes the targets of a cell. choices[c][k]: candidate c of beam k. Returns whether directions are aimed.
bool BeamGridBuilder::aim(Vector middle, const std::vector<std::vector<Vector>>& choices,
                          float* targets) const {
    const size_t n = choices.front().size();
    const std::vector<Vector>* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    std::vector<Vector> ways(n);
    // Choose the points that lie closest together. Near points show the cell's size alone.
    for (const auto& points : choices) {
        double sum = 0.0;
        for (size_t i = 0; i < n; ++i) ways[i] = direction(middle, points[i]);
        for (size_t i = 0; i < n; ++i) {
            const double distance = length(points[i] - middle);
            double nearest = 2.0;
            for (size_t j = 0; j < n; ++j)
                if (j != i) nearest = std::min(nearest, apart(ways[i], ways[j]));
            if (distance < 2.0 * grid_.side_) nearest = 2.0;
            sum += std::log(nearest + kLeastWidth);
        }
        if (!best || sum < least) best = &points, least = sum;
    }
    for (size_t i = 0; i < n; ++i) ways[i] = direction(middle, (*best)[i]);
    // A peak reaches to its third neighbour
    constexpr size_t kReach = 3;
    std::vector<double> off;
    double solid_angle = 0.0;
    for (size_t i = 0; i < static_cast<size_t>(kBeamTargets); ++i) {
        const size_t k = i % n;
        off.clear();
        for (size_t j = 0; j < n; ++j)
            if (j != k) off.push_back(apart(ways[k], ways[j]));
        std::sort(off.begin(), off.end());
        const double cell = grid_.side_ / std::max(length((*best)[k] - middle), grid_.side_);
        const double width = off.size() < kReach ? 0.1 * cell * cell : off[kReach - 1];
        if (off.size() >= kReach && i < n) solid_angle += 6.2831853 / kReach * width;
        const Vector p = (*best)[k];
        const double row[4] = {p.x, p.y, p.z, std::clamp(width, kLeastWidth, 1.0)};
        for (size_t c = 0; c < 4; ++c) targets[4 * i + c] = static_cast<float>(row[c]);
    }
    return solid_angle < kWide;
}

BeamGrid BeamGridBuilder::fill(const Place& from, const Place& to, const Places& candidates) const {
    BeamGrid out = grid_;
    std::vector<Kept> cells;
    for (size_t b = 0; b < beams_.size(); ++b) {
        if (b % 256 == 0) may_cancel();
        const Beam& beam = beams_[b];
        visit_cells(from(beam), to(beam), [&](size_t at) {
            if (!marked_[at]) return;
            int32_t& slot = out.slot_[at];
            if (slot < 0) slot = static_cast<int32_t>(cells.size()), cells.emplace_back().at = at;
            Kept& cell = cells[static_cast<size_t>(slot)];
            cell.flux += beam.weight;
            keep(cell, -std::log(random_number(b, at)) / beam.weight, static_cast<int32_t>(b));
        });
    }
    constexpr size_t kRow = size_t{4} * kBeamTargets, kBlock = 64;
    out.targets_.resize(cells.size() * kRow), out.flux_.resize(cells.size());
    std::vector<uint8_t> aims(cells.size());
    parallel_for(threads_, static_cast<int64_t>((cells.size() + kBlock - 1) / kBlock), {},
                 [&](int, int64_t block) {
                     const size_t first = static_cast<size_t>(block) * kBlock;
                     std::vector<std::vector<Vector>> choices;
                     for (size_t slot = first; slot < std::min(first + kBlock, cells.size()); ++slot) {
                         const Kept& cell = cells[slot];
                         choices.assign(3, {});
                         for (int32_t k = 0; k < cell.count; ++k) {
                             const auto points = candidates(beams_[static_cast<size_t>(cell.beam[k])]);
                             for (size_t c = 0; c < points.size(); ++c) choices[c].push_back(points[c]);
                         }
                         out.flux_[slot] = cell.flux;
                         aims[slot] = aim(middle(cell.at), choices, out.targets_.data() + slot * kRow);
                     }
                 });
    // Slots of cells that aim nowhere keep their flux alone
    for (size_t slot = 0; slot < cells.size(); ++slot)
        if (!aims[slot]) out.targets_[slot * kRow + 3] = 0.0f;
    return out;
}

BeamGridView BeamGrid::view() const {
    BeamGridView v{};
    if (targets_.empty()) return v;
    v.slot = slot_.data(), v.targets = targets_.data();
    v.inverse = static_cast<float>(1.0 / side_);
    for (size_t k = 0; k < 3; ++k) v.low[k] = static_cast<float>(low_[k]), v.count[k] = count_[k];
    return v;
}

int64_t BeamGrid::cell_of(Vector p) const {
    const double at[3] = {p.x, p.y, p.z};
    int64_t cell = 0;
    for (size_t k = 3; k-- > 0;) {
        const double i = std::floor((at[k] - low_[k]) / side_);
        if (!(i >= 0.0 && i < count_[k])) return -1;
        cell = cell * count_[k] + static_cast<int64_t>(i);
    }
    return cell;
}

double BeamGrid::flux(Vector p) const {
    const int64_t cell = cell_of(p);
    const int32_t slot = cell < 0 ? -1 : slot_[static_cast<size_t>(cell)];
    return slot < 0 ? 0.0 : flux_[static_cast<size_t>(slot)];
}

}  // namespace edgegrad
