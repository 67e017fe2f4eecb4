#include "sdf/bricks/coefficient_blocks.h"

#include <algorithm>
#include <cstring>

#include "util/parallel.h"

namespace edgegrad {

std::vector<uint8_t> copy_changes(const float* from, float* to, const int32_t (&size)[3], int threads) {
    const BlockGrid blocks(size);
    std::vector<uint8_t> changed(blocks.count());
    const auto row = static_cast<size_t>(size[2]), rows = static_cast<size_t>(size[1]);
    const auto differ = [&](size_t at, size_t count) {
        return std::memcmp(from + at, to + at, sizeof(float) * count) != 0;
    };
    parallel_for(threads, blocks.size[0], nullptr, [&](int, int64_t slab) {
        const auto first = static_cast<int32_t>(slab) * kBrickCells;
        for (int32_t i = first; i < std::min(size[0], first + kBrickCells); ++i)
            for (int32_t j = 0; j < size[1]; ++j) {
                const size_t at = (static_cast<size_t>(i) * rows + static_cast<size_t>(j)) * row;
                if (!differ(at, row)) continue;
                uint8_t* block = &changed[blocks.number(static_cast<int32_t>(slab), j / kBrickCells, 0)];
                for (size_t k = 0; k < row; k += kBrickCells, ++block) {
                    const size_t count = std::min<size_t>(kBrickCells, row - k);
                    if (!differ(at + k, count)) continue;
                    std::copy_n(from + at + k, count, to + at + k);
                    *block = 1;
                }
            }
    });
    if (std::find(changed.begin(), changed.end(), 1) == changed.end()) changed.clear();
    return changed;
}

void find_signs(const FieldView& f, const std::vector<uint8_t>& changed, int threads,
                std::vector<uint8_t>& signs) {
    const BlockGrid blocks(f.size);
    signs.resize(blocks.count());
    const int64_t row = f.size[2], layer = row * f.size[1];
    parallel_for(threads, blocks.size[0], nullptr, [&](int, int64_t slab) {
        std::vector<float> low(static_cast<size_t>(row)), high(low.size());
        const int64_t i0 = slab * kBrickCells, i1 = std::min<int64_t>(f.size[0], i0 + kBrickCells);
        for (int32_t b = 0; b < blocks.size[1]; ++b) {
            const size_t first = blocks.number(static_cast<int32_t>(slab), b, 0),
                         last = first + static_cast<size_t>(blocks.size[2]);
            if (!changed.empty() &&
                std::find(&changed[first], changed.data() + last, 1) == changed.data() + last)
                continue;
            const int64_t j0 = b * kBrickCells, j1 = std::min<int64_t>(f.size[1], j0 + kBrickCells);
            std::fill(low.begin(), low.end(), 3.4e38f);
            std::fill(high.begin(), high.end(), -3.4e38f);
            for (int64_t i = i0; i < i1; ++i)
                for (int64_t j = j0; j < j1; ++j) {
                    const float* c = f.values + i * layer + j * row;
                    float *l = low.data(), *h = high.data();
                    for (int64_t k = 0; k < row; ++k) {
                        l[k] = c[k] < l[k] ? c[k] : l[k];
                        h[k] = c[k] > h[k] ? c[k] : h[k];
                    }
                }
            uint8_t* out = &signs[first];
            for (int64_t k = 0; k < row; k += kBrickCells) {
                const int64_t end = std::min(row, k + kBrickCells);
                const bool positive = *std::min_element(low.begin() + k, low.begin() + end) > 0.0f,
                           negative = *std::max_element(high.begin() + k, high.begin() + end) < 0.0f;
                *out++ =
                    static_cast<uint8_t>((positive ? kPositiveBlock : 0) | (negative ? kNegativeBlock : 0));
            }
        }
    });
}

}  // namespace edgegrad
