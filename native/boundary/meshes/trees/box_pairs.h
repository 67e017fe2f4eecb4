// Finds the pairs of overlapping boxes among many.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "boundary/meshes/trees/face_tree.h"

namespace edgegrad {

// Two boxes by number.
using BoxPair = std::array<size_t, 2>;

// A tree of boxes. `pairs` queries it with each of its own boxes. Empty boxes overlap none. The boxes must
// outlive the tree.
class BoxPairs {
 public:
    explicit BoxPairs(const std::vector<Box>& boxes);

    // Calls visit_box(b) for each box b that overlaps `box`, in no particular order.
    template <typename Visit>
    void visit(const Box& box, const Visit& visit_box) const {
        visit_while(box, [&](size_t b) { return visit_box(b), true; });
    }

    // The same, until visit_box(b) returns false.
    template <typename Visit>
    void visit_while(const Box& box, const Visit& visit_box) const {
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
                if (boxes_[order_[k]].meets(box) && !visit_box(order_[k])) return;
        }
    }

    // The pairs (a, b), a < b, of overlapping boxes for which requested(a, b) holds, sorted by a and then by
    // b.
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
        size_t right;        // 0 for a leaf; the left child is the next node
    };

    size_t build(size_t first, size_t last);

    const std::vector<Box>& boxes_;
    std::vector<size_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace edgegrad
