#include "boundary/meshes/trees/box_pairs.h"

namespace edgegrad {
namespace {

constexpr size_t kLeafBoxes = 4;

}  // namespace

BoxPairs::BoxPairs(const std::vector<Box>& boxes) : boxes_(boxes) {
    for (size_t k = 0; k < boxes.size(); ++k)
        if (boxes[k].low[0] <= boxes[k].high[0]) order_.push_back(k);
    nodes_.reserve(2 * order_.size());
    if (!order_.empty()) build(0, order_.size());
}

size_t BoxPairs::build(size_t first, size_t last) {
    const size_t at = nodes_.size();
    Box box, middles;
    for (size_t k = first; k < last; ++k) {
        const Box& b = boxes_[order_[k]];
        box.add(b);
        float middle[3];
        for (int c = 0; c < 3; ++c) middle[c] = 0.5f * b.low[c] + 0.5f * b.high[c];
        middles.add(middle);
    }
    nodes_.push_back({box, first, last, 0});
    if (last - first <= kLeafBoxes) return at;
    int axis = 0;
    for (int c = 1; c < 3; ++c)
        if (middles.high[c] - middles.low[c] > middles.high[axis] - middles.low[axis]) axis = c;
    const auto order = order_.begin();
    const size_t half = first + (last - first) / 2;
    std::nth_element(order + static_cast<int64_t>(first), order + static_cast<int64_t>(half),
                     order + static_cast<int64_t>(last), [&](size_t a, size_t b) {
                         return boxes_[a].low[axis] + boxes_[a].high[axis] <
                                boxes_[b].low[axis] + boxes_[b].high[axis];
                     });
    build(first, half);
    const size_t right = build(half, last);  // build() may reallocate nodes_
    nodes_[at].right = right;
    return at;
}

}  // namespace edgegrad
