#include "sdf/carrier/thin_parts.h"

#include <algorithm>
#include <set>

#include "util/parallel.h"

namespace edgegrad {
namespace {

constexpr int kMostParts = 8;
// Number of parts of all these cells up to which they are marched.
constexpr size_t kMostMarched = size_t{1} << 20;

// The weights of the four coefficients at the corners of parts.
struct Weights {
    double at[kMostParts + 1][4];

    Weights() {
        for (int n = 0; n <= kMostParts; ++n) {
            const double u = static_cast<double>(n) / kMostParts, v = 1.0 - u;
            at[n][0] = v * v * v / 6.0;
            at[n][1] = (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0;
            at[n][2] = (4.0 - 6.0 * v * v + 3.0 * v * v * v) / 6.0;
            at[n][3] = u * u * u / 6.0;
        }
    }
};

// The least number of parts of a cell at whose corners the field has both signs; 0: none shows them.
int parts_that_show(const FieldView& f, const Cell& cell) {
    static const Weights weights;
    constexpr int kNodes = kMostParts + 1;
    const int64_t row = f.size[2], slab = row * f.size[1];
    const float* c = f.values + cell[0] * slab + cell[1] * row + cell[2];
    double along[4][4][kNodes], across[4][kNodes][kNodes];
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            for (int n = 0; n < kNodes; ++n) {
                const double* w = weights.at[n];
                const float* at = c + i * slab + j * row;
                along[i][j][n] = w[0] * static_cast<double>(at[0]) + w[1] * static_cast<double>(at[1]) +
                                 w[2] * static_cast<double>(at[2]) + w[3] * static_cast<double>(at[3]);
            }
    for (int i = 0; i < 4; ++i)
        for (int m = 0; m < kNodes; ++m)
            for (int n = 0; n < kNodes; ++n) {
                const double* w = weights.at[m];
                across[i][m][n] = w[0] * along[i][0][n] + w[1] * along[i][1][n] + w[2] * along[i][2][n] +
                                  w[3] * along[i][3][n];
            }
    const auto shows = [&](int parts) {
        bool inside = false, outside = false;
        const int step = kMostParts / parts;
        for (int l = 0; l < kNodes; l += step)
            for (int m = 0; m < kNodes; m += step)
                for (int n = 0; n < kNodes; n += step) {
                    const double* w = weights.at[l];
                    const double value = w[0] * across[0][m][n] + w[1] * across[1][m][n] +
                                         w[2] * across[2][m][n] + w[3] * across[3][m][n];
                    (value < 0.0 ? inside : outside) = true;
                    if (inside && outside) return true;
                }
        return false;
    };
    for (int parts = 1; parts <= kMostParts; parts *= 2)
        if (shows(parts)) return parts;
    return 0;
}

}  // namespace

bool FineRegion::contains(const Cell& cell) const {
    return std::binary_search(cells.begin(), cells.end(), cell);
}

ThinParts::ThinParts(const FieldView& field)
    : field_(field), columns_(static_cast<size_t>(field.cells(2)) + 2) {
    for (auto& state : state_)
        state.assign((static_cast<size_t>(field.cells(1)) + 2) * columns_, static_cast<uint8_t>(kNone));
}

void ThinParts::add(const Cell& cell, bool crosses) {
    while (last_ < cell[0]) close_slab();
    const auto slab = static_cast<size_t>(cell[0] % 3);
    state_[slab][static_cast<size_t>(cell[1] + 1) * columns_ + static_cast<size_t>(cell[2] + 1)] =
        crosses ? kCrosses : kMixed;
    (crosses ? crossing_ : mixed_[slab]).push_back(cell);
}

void ThinParts::close_slab() {
    if (last_ >= 1)
        for (const Cell& cell : mixed_[static_cast<size_t>((last_ - 1) % 3)]) {
            if (beside_crossing(cell[1], cell[2])) continue;
            if (const int parts = parts_that_show(field_, cell)) {
                thin_.push_back(cell);
                shown_ = std::max(shown_, parts);
            }
        }
    const auto next = static_cast<size_t>(++last_ % 3);
    std::fill(state_[next].begin(), state_[next].end(), static_cast<uint8_t>(kNone));
    mixed_[next].clear();
}

bool ThinParts::beside_crossing(int j, int k) const {
    for (const auto& state : state_)
        for (int row = j; row < j + 3; ++row) {
            const uint8_t* at = &state[static_cast<size_t>(row) * columns_ + static_cast<size_t>(k)];
            if (at[0] == kCrosses || at[1] == kCrosses || at[2] == kCrosses) return true;
        }
    return false;
}

FineRegion ThinParts::region() {
    for (int k = 0; k < 2; ++k) close_slab();
    FineRegion out;
    if (thin_.empty()) return out;
    // Parts that just show a surface may miss its tips
    for (const int parts : {std::min(kMostParts, 2 * shown_), shown_})
        if (follow(parts, out)) return out;
    out = {};
    out.complete = false;
    return out;
}

bool ThinParts::follow(int parts, FineRegion& out) const {
    const size_t most = kMostMarched / static_cast<size_t>(parts * parts * parts);
    std::set<Cell> known(thin_.begin(), thin_.end());
    std::vector<Cell> next = thin_;
    out = {thin_, parts};
    while (!next.empty()) {
        if (out.cells.size() > most) return false;
        may_cancel();
        const Cell from = next.back();
        next.pop_back();
        for (int n = 0; n < 27; ++n) {
            const Cell cell{from[0] + n / 9 - 1, from[1] + n / 3 % 3 - 1, from[2] + n % 3 - 1};
            bool within = true;
            for (size_t a = 0; a < 3; ++a)
                within = within && cell[a] >= 0 && cell[a] < field_.cells(static_cast<int>(a));
            if (!within || !known.insert(cell).second) continue;
            const bool crosses = std::binary_search(crossing_.begin(), crossing_.end(), cell);
            const int shown = crosses ? 1 : parts_that_show(field_, cell);
            if (shown == 0 || shown > parts) continue;
            out.crosses = out.crosses || crosses;
            out.cells.push_back(cell);
            next.push_back(cell);
        }
    }
    std::sort(out.cells.begin(), out.cells.end());
    return true;
}

}  // namespace edgegrad
