#include "sdf/coefficient_blocks.h"

#include <algorithm>

#include "util/parallel.h"

namespace edgegrad {

CoefficientBlocks::CoefficientBlocks(const FieldView& f, const int32_t (&from)[3], const int32_t (&to)[3],
                                     int threads) {
    for (int a = 0; a < 3; ++a) {
        from_[a] = from[a];
        size_[a] = std::max(0, std::min(to[a], count(f, a)) - from[a]);
    }
    blocks_.resize(static_cast<size_t>(size_[0]) * static_cast<size_t>(size_[1]) *
                   static_cast<size_t>(size_[2]));
    parallel_for(threads, size_[0], nullptr, [&](int, int64_t slab) { read(f, static_cast<int32_t>(slab)); });
}

// Reads a slab of blocks.
void CoefficientBlocks::read(const FieldView& f, int32_t slab) {
    const int64_t row = f.size[2], layer = row * f.size[1];
    const int32_t first = kBlockSide * from_[2],
                  width = std::min(f.size[2], kBlockSide * (from_[2] + size_[2])) - first;
    std::vector<float> low(static_cast<size_t>(width)), high(low.size());
    const int32_t i0 = kBlockSide * (from_[0] + slab), i1 = std::min(f.size[0], i0 + kBlockSide);
    Extremes* out =
        &blocks_[static_cast<size_t>(slab) * static_cast<size_t>(size_[1]) * static_cast<size_t>(size_[2])];
    for (int32_t b = 0; b < size_[1]; ++b) {
        const int32_t j0 = kBlockSide * (from_[1] + b), j1 = std::min(f.size[1], j0 + kBlockSide);
        std::fill(low.begin(), low.end(), 3.4e38f);
        std::fill(high.begin(), high.end(), -3.4e38f);
        for (int32_t i = i0; i < i1; ++i)
            for (int32_t j = j0; j < j1; ++j) {
                const float* c = f.values + i * layer + j * row + first;
                float *l = low.data(), *h = high.data();
                for (int32_t k = 0; k < width; ++k) {
                    l[k] = c[k] < l[k] ? c[k] : l[k];
                    h[k] = c[k] > h[k] ? c[k] : h[k];
                }
            }
        for (int32_t k = 0; k < width; k += kBlockSide) {
            const int32_t end = std::min(width, k + kBlockSide);
            *out++ = {*std::min_element(low.begin() + k, low.begin() + end),
                      *std::max_element(high.begin() + k, high.begin() + end)};
        }
    }
}

bool CoefficientBlocks::one_sign(const int32_t (&brick)[3]) const {
    float low = 3.4e38f, high = -3.4e38f;
    int32_t first[3], last[3];
    for (int a = 0; a < 3; ++a) {
        first[a] = brick[a] - from_[a];
        last[a] = std::min(first[a] + 1, size_[a] - 1);
    }
    for (int32_t i = first[0]; i <= last[0]; ++i)
        for (int32_t j = first[1]; j <= last[1]; ++j)
            for (int32_t k = first[2]; k <= last[2]; ++k) {
                const Extremes& e = blocks_[(static_cast<size_t>(i) * static_cast<size_t>(size_[1]) +
                                             static_cast<size_t>(j)) *
                                                static_cast<size_t>(size_[2]) +
                                            static_cast<size_t>(k)];
                low = std::min(low, e.low), high = std::max(high, e.high);
            }
    return low > 0.0f || high < 0.0f;
}

}  // namespace edgegrad
