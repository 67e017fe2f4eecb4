// Trees of faces that find the pairs of faces which may intersect.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "scene/tables.h"
#include "util/double_vector.h"

namespace edgegrad {

struct Box {
    float low[3] = {3e38f, 3e38f, 3e38f}, high[3] = {-3e38f, -3e38f, -3e38f};

    void add(const float* p) {
        for (int c = 0; c < 3; ++c) low[c] = std::min(low[c], p[c]), high[c] = std::max(high[c], p[c]);
    }
    void add(const Box& b) {
        for (int c = 0; c < 3; ++c)
            low[c] = std::min(low[c], b.low[c]), high[c] = std::max(high[c], b.high[c]);
    }
    bool is_empty() const { return low[0] > high[0]; }
    bool meets(const Box& b) const {
        return low[0] <= b.high[0] && b.low[0] <= high[0] && low[1] <= b.high[1] && b.low[1] <= high[1] &&
               low[2] <= b.high[2] && b.low[2] <= high[2];
    }
};

const float* corner(const SceneTables& t, int32_t face, size_t k);
Box box_of(const SceneTables& t, int32_t face);
Box mesh_box(const SceneTables& t, size_t mesh);
// Those of all visible meshes, each in its own space.
struct MeshBoxes {
    explicit MeshBoxes(const SceneTables& t);
    std::vector<Box> of;
};
// For each of `boxes`, the faces of the mesh whose own bounding boxes overlap it, in ascending order.
std::vector<std::vector<int32_t>> faces_in(const SceneTables& t, int32_t mesh, std::span<const Box> boxes,
                                           int threads);

// A tree of boxes over faces, which are sorted along a Morton curve.
class FaceTree {
 public:
    FaceTree(const SceneTables& tables, std::vector<int32_t> faces, int threads);

    size_t size() const { return faces_.size(); }

    // Calls visit_face(face) for the faces whose boxes overlap `box`.
    template <typename Visit>
    void visit(const Box& box, const Visit& visit_face) const {
        if (nodes_.empty()) return;
        size_t stack[64], top = 0;
        stack[top++] = 0;
        while (top > 0) {
            const size_t at = stack[--top];
            const Node& node = nodes_[at];
            if (!node.box.meets(box)) continue;
            if (node.leaf()) {
                const Leaf& leaf = leaves_[node.first_leaf];
                for_each_bit(leaf.meets(box), [&](size_t k) { visit_face(leaf.face[k]); });
            } else {
                stack[top++] = node.right;
                stack[top++] = at + 1;
            }
        }
    }

    // The numbers of two nodes, which may be the same. The second may be of another tree.
    using Pair = std::array<size_t, 2>;

    // About `requested` pairs of nodes of this tree and another. Together they cover all pairs of faces whose
    // boxes overlap. `map` bounds a box of this tree in the other one's space.
    template <typename Map>
    std::vector<Pair> pairs(const FaceTree& other, const Map& map, size_t requested) const {
        std::vector<Pair> found, next;
        if (!nodes_.empty() && !other.nodes_.empty()) found.push_back({0, 0});
        for (bool divided = true; divided && found.size() < requested; std::swap(found, next)) {
            next.clear();
            divided = false;
            const auto add = [&](const Pair& half) { next.push_back(half); };
            for (const Pair& pair : found) {
                const bool leaves = !visit_halves(other, pair, map, add);
                if (leaves) next.push_back(pair);
                divided |= !leaves;
            }
        }
        return found;
    }

    // Calls visit_pair(face, face of the other tree) for the pairs of faces of two nodes whose boxes overlap,
    // until it returns false.
    template <typename Map, typename Visit>
    void visit_pairs(const FaceTree& other, Pair first, const Map& map, const Visit& visit_pair) const {
        std::vector<Pair> stack{first};
        while (!stack.empty()) {
            const Pair pair = stack.back();
            stack.pop_back();
            if (visit_halves(other, pair, map, [&](const Pair& half) { stack.push_back(half); })) continue;
            const Node& node = nodes_[pair[0]];
            const Leaf &s = leaves_[node.first_leaf], &t = other.leaves_[other.nodes_[pair[1]].first_leaf];
            bool goes_on = true;
            for (size_t j = 0; j < node.count() && goes_on; ++j)
                for_each_bit(t.meets(map(s.box(j))),
                             [&](size_t k) { goes_on = goes_on && visit_pair(s.face[j], t.face[k]); });
            if (!goes_on) return;
        }
    }

 private:
    friend class OwnPairs;
    static constexpr size_t kLeaf = 8;

    struct Node {
        Box box;
        uint32_t first = 0, last = 0;  // faces_[first] to faces_[last - 1]
        uint32_t right = 0;            // 0 for a leaf; the left child is the next node
        uint32_t first_leaf = 0;

        bool leaf() const { return right == 0; }
        uint32_t count() const { return last - first; }
    };

    // The faces of a leaf, stored by coordinate so that one box is compared with all of them at once. Unused
    // slots overlap no box.
    struct Leaf {
        float low[3][kLeaf], high[3][kLeaf];
        int32_t vertex[3][kLeaf], face[kLeaf];

        Box box(size_t k) const {
            return {{low[0][k], low[1][k], low[2][k]}, {high[0][k], high[1][k], high[2][k]}};
        }
        // The faces whose boxes overlap `b`, one bit each.
        uint32_t meets(const Box& b) const;
        // The faces that have one of these three vertices, one bit each.
        uint32_t with_vertex(int32_t a, int32_t b, int32_t c) const;
    };

    template <typename F>
    static void for_each_bit(uint32_t bits, const F& visit_bit) {
        for (; bits; bits &= bits - 1) visit_bit(static_cast<size_t>(std::countr_zero(bits)));
    }

    // Calls visit_half(pair) for the two pairs that result when the larger node of a pair of this tree and
    // another is replaced by its children, and whose boxes overlap. Returns false for two leaves that
    // overlap.
    template <typename Map, typename Visit>
    bool visit_halves(const FaceTree& other, Pair pair, const Map& map, const Visit& visit_half) const {
        const Node &s = nodes_[pair[0]], &t = other.nodes_[pair[1]];
        if (!map(s.box).meets(t.box)) return true;
        if (s.leaf() && t.leaf()) return false;
        if (t.leaf() || (!s.leaf() && s.count() >= t.count())) {
            visit_half({pair[0] + 1, pair[1]}), visit_half({s.right, pair[1]});
        } else {
            visit_half({pair[0], pair[1] + 1}), visit_half({pair[0], t.right});
        }
        return true;
    }

    // Makes the nodes over a range of faces, from number `at` on, without their boxes.
    void make_nodes(size_t at, uint32_t first, uint32_t last, uint32_t first_leaf);
    void fill_leaf(Node& node);

    const SceneTables& tables_;
    std::vector<int32_t> faces_;  // in the order of leaves
    std::vector<Node> nodes_;
    std::unique_ptr<Leaf[]> leaves_;
};

}  // namespace edgegrad
