#include "sdf/bricks/bricks.h"

#include <algorithm>
#include <cmath>

#include "util/parallel.h"

namespace edgegrad {
namespace {

constexpr int kTaps = 4;  // coefficients of a cell along an axis

struct Extremes {
    float low = 3.4e38f, high = -3.4e38f;
    void add(float x) { low = std::min(low, x), high = std::max(high, x); }
};

class BrickFinder {
 public:
    explicit BrickFinder(const FieldView& f) : f_(f), step_{int64_t{f.size[1]} * f.size[2], f.size[2], 1} {}

    // The brick from cell `first` on. Returns whether the surface may be in it.
    bool find(const int32_t (&first)[3], FieldBrick& brick) const {
        Cells cells{{}, {}, {first[0], first[1], first[2]}, {}};
        for (int a = 0; a < 3; ++a) cells.count[a] = std::min(kBrickCells, f_.cells(a) - first[a]);
        find_mixed(cells);
        int32_t low[3] = {0, 0, 0}, high[3] = {cells.count[0], cells.count[1], cells.count[2]};
        for (int a = 0; a < 3; ++a) {
            while (low[a] < high[a] && !reaches(cells, a, low[a])) ++low[a];
            if (low[a] == high[a]) return false;
            while (!reaches(cells, a, high[a] - 1)) --high[a];
        }
        for (int a = 0; a < 3; ++a) brick.first[a] = first[a] + low[a], brick.last[a] = first[a] + high[a];
        for (int a = 0; a < 3; ++a) {
            brick.lower[a] = static_cast<float>(brick.first[a]) - (brick.first[a] > 0 ? kBrickOverlap : 0.0f);
            brick.upper[a] =
                static_cast<float>(brick.last[a]) + (brick.last[a] < f_.cells(a) ? kBrickOverlap : 0.0f);
        }
        brick.lower[3] = -1.0f, brick.upper[3] = 1.0f;
        bound_curvature(brick);
        fit_plane(brick);
        return true;
    }

 private:
    const float* at(int32_t i, int32_t j, int32_t k) const {
        return f_.values + i * step_[0] + j * step_[1] + k * step_[2];
    }

    // The cells of a brick, those of a row as bits.
    struct Cells {
        uint32_t mixed[kBrickCells][kBrickCells];  // not proven empty: their coefficients have both signs
        uint32_t met[kBrickCells][kBrickCells];    // the surface may be in them
        int32_t first[3], count[3];
    };

    void find_mixed(Cells& cells) const {
        // Bits of the coefficients that are not positive, or not negative
        constexpr int32_t kReach = kBrickCells + kTaps - 1;
        uint32_t rows[2][kReach][kReach];
        int32_t count[3];  // of coefficients
        for (int a = 0; a < 3; ++a) count[a] = cells.count[a] + kTaps - 1;
        for (int32_t i = 0; i < count[0]; ++i)
            for (int32_t j = 0; j < count[1]; ++j) {
                const float* row = at(cells.first[0] + i, cells.first[1] + j, cells.first[2]);
                uint32_t below = 0, above = 0;
                for (int32_t k = 0; k < count[2]; ++k) {
                    below |= static_cast<uint32_t>(row[k] <= 0.0f) << k;
                    above |= static_cast<uint32_t>(row[k] >= 0.0f) << k;
                }
                rows[0][i][j] = below | below >> 1 | below >> 2 | below >> 3;
                rows[1][i][j] = above | above >> 1 | above >> 2 | above >> 3;
            }
        for (int32_t i = 0; i < cells.count[0]; ++i)
            for (int32_t j = 0; j < cells.count[1]; ++j) {
                uint32_t some[2] = {0, 0};
                for (int side = 0; side < 2; ++side)
                    for (int a = 0; a < kTaps; ++a)
                        for (int b = 0; b < kTaps; ++b) some[side] |= rows[side][i + a][j + b];
                cells.mixed[i][j] = some[0] & some[1] & ((1u << cells.count[2]) - 1u);
            }
    }

    // Whether the surface may be in one of the cells at `place` along an axis. Most slabs have such a cell,
    // so that few of their cells are tested.
    bool reaches(Cells& cells, int axis, int32_t place) const {
        int32_t from[3] = {0, 0, 0}, to[3] = {cells.count[0], cells.count[1], cells.count[2]};
        from[axis] = place, to[axis] = place + 1;
        for (int32_t i = from[0]; i < to[0]; ++i)
            for (int32_t j = from[1]; j < to[1]; ++j)
                for (int32_t k = from[2]; k < to[2]; ++k) {
                    const uint32_t bit = 1u << k;
                    if (cells.met[i][j] & bit) return true;
                    if (!(cells.mixed[i][j] & bit)) continue;
                    if (!is_empty_cell({cells.first[0] + i, cells.first[1] + j, cells.first[2] + k})) {
                        cells.met[i][j] |= bit;
                        return true;
                    }
                    cells.mixed[i][j] &= ~bit;
                }
        return false;
    }

    // Whether the polynomial of a cell has no root there. Its Bezier points are convex combinations of its
    // coefficients, and so nearer to it.
    bool is_empty_cell(const int32_t (&cell)[3]) const {
        constexpr float kRounding = 1e-6f;
        float p[kTaps][kTaps][kTaps], largest = 0.0f;
        for (int i = 0; i < kTaps; ++i)
            for (int j = 0; j < kTaps; ++j)
                for (int k = 0; k < kTaps; ++k) {
                    const float c = at(cell[0] + i, cell[1] + j, cell[2])[k];
                    p[i][j][k] = c;
                    largest = std::max(largest, std::abs(c));
                }
        for (int a = 0; a < kTaps; ++a)
            for (int b = 0; b < kTaps; ++b) to_bezier(p[0][a][b], p[1][a][b], p[2][a][b], p[3][a][b]);
        for (int a = 0; a < kTaps; ++a)
            for (int b = 0; b < kTaps; ++b) to_bezier(p[a][0][b], p[a][1][b], p[a][2][b], p[a][3][b]);
        Extremes points;
        for (int a = 0; a < kTaps; ++a)
            for (int b = 0; b < kTaps; ++b) {
                to_bezier(p[a][b][0], p[a][b][1], p[a][b][2], p[a][b][3]);
                for (int k = 0; k < kTaps; ++k) points.add(p[a][b][k]);
            }
        return points.low > kRounding * largest || points.high < -kRounding * largest;
    }

    static void to_bezier(float& a, float& b, float& c, float& d) {
        const float first = (a + 4.0f * b + c) / 6.0f, last = (b + 4.0f * c + d) / 6.0f;
        const float second = (2.0f * b + c) / 3.0f, third = (b + 2.0f * c) / 3.0f;
        a = first, b = second, c = third, d = last;
    }

    void bound_curvature(FieldBrick& b) const {
        int32_t count[3];  // of coefficients
        for (int a = 0; a < 3; ++a) count[a] = b.last[a] - b.first[a] + kTaps - 1;
        constexpr int axes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
        for (int n = 0; n < 6; ++n) {
            const int p = axes[n][0], q = axes[n][1];
            int32_t end[3] = {count[0], count[1], count[2]};
            --end[p], --end[q];
            const int64_t sp = step_[p], sq = step_[q];
            Extremes e;
            for (int32_t i = 0; i < end[0]; ++i)
                for (int32_t j = 0; j < end[1]; ++j) {
                    const float* row = at(b.first[0] + i, b.first[1] + j, b.first[2]);
                    for (int32_t k = 0; k < end[2]; ++k)
                        e.add((row[k + sp + sq] - row[k + sp]) - (row[k + sq] - row[k]));
                }
            b.low[n] = e.low, b.high[n] = e.high;
        }
    }

    // The B-spline reproduces affine functions, whose coefficients are their values. So the difference is a
    // convex combination of the differences of the coefficients.
    void fit_plane(FieldBrick& b) const {
        constexpr float kRounding = 2e-6f;
        int32_t count[3];
        for (int a = 0; a < 3; ++a) count[a] = b.last[a] - b.first[a] + kTaps - 1;
        const auto each = [&](const auto& visit) {
            for (int32_t i = 0; i < count[0]; ++i)
                for (int32_t j = 0; j < count[1]; ++j) {
                    const float* row = at(b.first[0] + i, b.first[1] + j, b.first[2]);
                    for (int32_t k = 0; k < count[2]; ++k) visit(i, j, k, row[k]);
                }
        };
        // Slopes by least squares: the coefficients' correlation with their centred places
        double sum[3] = {0.0, 0.0, 0.0};
        each([&](int32_t i, int32_t j, int32_t k, float c) {
            sum[0] += (i - 0.5 * (count[0] - 1)) * c;
            sum[1] += (j - 0.5 * (count[1] - 1)) * c;
            sum[2] += (k - 0.5 * (count[2] - 1)) * c;
        });
        const double all = static_cast<double>(count[0]) * count[1] * count[2];
        for (int a = 0; a < 3; ++a) {
            const double n = count[a];
            b.slope[a] = static_cast<float>(sum[a] * 12.0 / (all * (n * n - 1.0)));
        }
        Extremes rest, taps;
        each([&](int32_t i, int32_t j, int32_t k, float c) {
            rest.add(c - (b.slope[0] * static_cast<float>(i - 1) + b.slope[1] * static_cast<float>(j - 1) +
                          b.slope[2] * static_cast<float>(k - 1)));
            taps.add(c);
        });
        b.value = 0.5f * (rest.low + rest.high);
        b.error = 0.5f * (rest.high - rest.low) + kRounding * std::max(-taps.low, taps.high);
    }

    const FieldView& f_;
    const int64_t step_[3];
};

}  // namespace

void TracedField::set_view(const FieldView& next) {
    view = next;
    for (int c = 0; c < 4; ++c)
        for (int a = 0; a < 4; ++a) to_grid[c][a] = a < 3 ? view.to_grid[a][c] : 0.0;
}

void TracedField::find_bricks(const std::vector<uint8_t>& changed, int threads) {
    // The signs of whole blocks prove most bricks empty, which read each coefficient several times.
    const BlockGrid blocks(view.size);
    const BrickFinder finder(view);
    // Slabs are found at the same time, and joined in the order of the grid.
    int32_t count[3];
    for (int a = 0; a < 3; ++a) count[a] = (view.cells(a) + kBrickCells - 1) / kBrickCells;
    std::vector<std::vector<FieldBrick>> found(static_cast<size_t>(count[0]));
    parallel_for(threads, count[0], nullptr, [&](int, int64_t slab) {
        const auto i = static_cast<int32_t>(slab);
        std::vector<FieldBrick>& out = found[static_cast<size_t>(slab)];
        auto before = std::partition_point(bricks.begin(), bricks.end(),
                                           [&](const FieldBrick& b) { return b.first[0] / kBrickCells < i; });
        FieldBrick brick;
        for (int32_t j = 0; j < count[1]; ++j)
            for (int32_t k = 0; k < count[2]; ++k) {
                const int32_t first[3] = {i * kBrickCells, j * kBrickCells, k * kBrickCells};
                const bool known = before != bricks.end() && before->is_from(first);
                uint8_t all = kPositiveBlock | kNegativeBlock, any = changed.empty();
                for (int32_t corner = 0; corner < 8; ++corner) {
                    const size_t block = blocks.read_by_brick(i, j, k, corner);
                    all &= view.signs[block];
                    if (!any) any = changed[block];
                }
                if (all == 0) {
                    if (!any && known) out.push_back(*before);
                    if (any && finder.find(first, brick)) out.push_back(brick);
                }
                before += known;
            }
    });
    bricks.clear();
    for (const auto& slab : found) bricks.insert(bricks.end(), slab.begin(), slab.end());
}

void TracedField::bounds(size_t brick, embree::Bounds& box) const {
    const FieldBrick& b = bricks[brick];
    double low[3], high[3], size = 0.0;
    for (int c = 0; c < 3; ++c) {
        low[c] = high[c] = view.to_world[c][3];
        for (int a = 0; a < 3; ++a) {
            const double m = view.to_world[c][a], x = m * (b.first[a] - kBrickOverlap),
                         y = m * (b.last[a] + kBrickOverlap);
            low[c] += std::min(x, y), high[c] += std::max(x, y);
        }
        size = std::max({size, std::abs(low[c]), std::abs(high[c])});
    }
    const double slack = 1e-6 * size;  // rounding of the box and of rays
    const auto put = [&](float* out, const double (&p)[3], double by) {
        for (int c = 0; c < 3; ++c) out[c] = static_cast<float>(p[c] + by);
    };
    put(box.lower, low, -slack);
    put(box.upper, high, slack);
}

}  // namespace edgegrad
