// Pairs of boxes that meet, of very many.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "boundary/meshes/face_tree.h"

namespace edgegrad {

// Two boxes by number.
using BoxPair = std::array<size_t, 2>;

// The pairs (a, b), a < b, of boxes that meet, in the order of a and then b. A tree of boxes is walked
// through with each of them; empty boxes meet none.
class BoxPairs {
 public:
    explicit BoxPairs(const std::vector<Box>& boxes);

    // visit(b) for the boxes that meet a box, in no order.
    template <typename Visit>
    void visit(const Box& box, const Visit& visit_box) const {
        std::vector<size_t> stack;
        if (!order_.empty()) stack.push_back(0);
        while (!stack.empty()) {
            const Node& node = nodes_[stack.back()];
            const size_t at = stack.back();
            stack.pop_back();
            if (!node.box.meets(box)) continue;
            if (node.right) {
                stack.push_back(node.right);
                stack.push_back(at + 1);
                continue;
            }
            for (size_t k = node.first; k < node.last; ++k)
                if (boxes_[order_[k]].meets(box)) visit_box(order_[k]);
        }
    }

    // Those of the pairs that wanted(a, b).
    template <typename Requested>
    std::vector<BoxPair> pairs(const Requested& requested) const {
        std::vector<BoxPair> out;
        for (size_t a = 0; a < boxes_.size(); ++a) {
            const size_t before = out.size();
            visit(boxes_[a], [&](size_t b) {
                if (a < b && requested(a, b)) out.push_back({a, b});
            });
            std::sort(out.begin() + static_cast<int64_t>(before), out.end());
        }
        return out;
    }

 private:
    struct Node {
        Box box;
        size_t first, last;  // order_[first] to order_[last - 1]
        size_t right;        // 0: a leaf; the left child comes next
    };

    size_t build(size_t first, size_t last);

    const std::vector<Box>& boxes_;
    std::vector<size_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace edgegrad
