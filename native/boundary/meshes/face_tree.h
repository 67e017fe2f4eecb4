// A tree of faces that finds the pairs of faces which may intersect.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "scene/tables.h"
#include "util/double_vector.h"

namespace edgegrad {

// Radians. Two parts of one mesh whose normals differ by less than this angle are assumed not to intersect,
// as patches of one smooth surface. A smaller angle searches more pairs of faces.
constexpr double kOneDirection = 0.9;

struct Box {
    float low[3] = {3e38f, 3e38f, 3e38f}, high[3] = {-3e38f, -3e38f, -3e38f};

    void add(const float* p) {
        for (int c = 0; c < 3; ++c) low[c] = std::min(low[c], p[c]), high[c] = std::max(high[c], p[c]);
    }
    void add(const Box& b) {
        for (int c = 0; c < 3; ++c)
            low[c] = std::min(low[c], b.low[c]), high[c] = std::max(high[c], b.high[c]);
    }
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
// For each of `boxes`, the faces of the mesh whose own bounding boxes overlap it.
std::vector<std::vector<int32_t>> faces_in(const SceneTables& t, int32_t mesh, std::span<const Box> boxes,
                                           int threads);

// A cone of directions about an axis.
struct Cone {
    Vector axis;
    // Cosine and sine of kOneDirection/2 minus the cone's half angle. The cosine is below -1 if that is
    // negative.
    double cosine, sine;

    Cone() = default;
    Cone(Vector to, double angle);
    // Whether any two directions, one from each cone, differ by less than kOneDirection. This holds if the
    // sum of the remaining angles exceeds the angle between the axes.
    bool narrow(const Cone& other) const {
        return cosine > -1.0 && other.cosine > -1.0 &&
               dot(axis, other.axis) > cosine * other.cosine - sine * other.sine;
    }
};

// A tree of boxes over faces, with the cone of the faces' normals at each node. A node is split when a search
// first reaches it, by whichever thread reaches it. A search of a smooth surface reaches few nodes. The
// results and their order do not depend on which nodes have been split before.
class FaceTree {
 public:
    // `threads` is the number of threads of the constructor and of `pairs`.
    FaceTree(const SceneTables& tables, std::vector<int32_t> faces, int threads);

    // Calls visit_face(face) for the faces whose boxes overlap `box`.
    template <typename Visit>
    void visit(const Box& box, const Visit& visit_face) const {
        if (!nodes_) return;
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
                split(at);
                stack[top++] = node.right;
                stack[top++] = at + 1;
            }
        }
    }

    // The numbers of two nodes, which may be the same.
    using Pair = std::array<size_t, 2>;

    // About `requested` pairs of nodes. Together they cover all pairs of faces that may intersect, except
    // pairs within patches of nearly one direction (kOneDirection).
    std::vector<Pair> pairs(size_t requested) const;

    // Calls visit_pair(face, other) for the pairs of faces of two nodes whose boxes overlap. Left out are
    // pairs within such patches and pairs that share a vertex.
    template <typename Visit>
    void visit_pairs(Pair first, const Visit& visit_pair) const {
        std::vector<Pair> stack;
        const auto add = [&](const Pair& pair) {
            if (may_cross(pair)) stack.push_back(pair);
        };
        add(first);
        while (!stack.empty()) {
            const Pair pair = stack.back();
            stack.pop_back();
            if (both_leaves(pair))
                visit_leaves(pair, visit_pair);
            else
                divide(pair, add);
        }
    }

 private:
    static constexpr size_t kLeaf = 8;

    // Whether a node's children exist.
    enum State : uint8_t { kWhole, kBeingSplit, kSplit };

    struct Node {
        Box box;
        Cone cone;
        uint32_t first = 0, last = 0;  // faces order_[first] to order_[last - 1]
        uint32_t right = 0;            // 0 for a leaf; the left child is the next node
        uint32_t first_leaf = 0;
        uint32_t axis = 0;  // along which the faces' centres spread most
        std::atomic<uint8_t> state = kWhole;

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

    bool both_leaves(const Pair& pair) const { return nodes_[pair[0]].leaf() && nodes_[pair[1]].leaf(); }
    bool may_cross(const Pair& pair) const {
        const Node &s = nodes_[pair[0]], &t = nodes_[pair[1]];
        return s.box.meets(t.box) && !s.cone.narrow(t.cone);
    }
    // The node of the pair to replace by its children: the larger one. At least one node is not a leaf.
    size_t divided(const Pair& pair) const {
        const Node &s = nodes_[pair[0]], &t = nodes_[pair[1]];
        return pair[0] != pair[1] && (t.leaf() || (!s.leaf() && s.count() >= t.count())) ? pair[0] : pair[1];
    }

    // Calls add(pair) for the pairs that result when one of the two nodes is replaced by its children.
    template <typename Add>
    void divide(const Pair& pair, const Add& add) const {
        const auto [a, b] = pair;
        const size_t at = divided(pair), right = nodes_[at].right;
        split(at);
        if (a == b) {
            add({a + 1, a + 1});
            add({right, right});
            add({a + 1, right});
        } else if (at == a) {
            add({a + 1, b});
            add({right, b});
        } else {
            add({a, b + 1});
            add({a, right});
        }
    }

    template <typename Visit>
    void visit_leaves(const Pair& pair, const Visit& visit_pair) const {
        const Leaf &s = leaves_[nodes_[pair[0]].first_leaf], &t = leaves_[nodes_[pair[1]].first_leaf];
        const bool one = pair[0] == pair[1];
        for_each_bit(s.meets(nodes_[pair[1]].box), [&](size_t j) {
            uint32_t others = t.meets(s.box(j));
            if (one) others &= ~0u << (j + 1);
            if (others) others &= ~t.with_vertex(s.vertex[0][j], s.vertex[1][j], s.vertex[2][j]);
            for_each_bit(others, [&](size_t k) { visit_pair(s.face[j], t.face[k]); });
        });
    }

    // Fills a node from its range of faces, without its children. A leaf gets its faces.
    void make(size_t at, uint32_t first, uint32_t last, uint32_t first_leaf) const;
    // Makes the node's children, or waits if another thread is making them.
    void split(size_t at) const {
        if (nodes_[at].state.load(std::memory_order_acquire) != kSplit) split_once(at);
    }
    void split_once(size_t at) const;
    void make_children(size_t at) const;
    void split_wide() const;

    const SceneTables& tables_;
    int threads_;
    std::vector<int32_t> faces_;
    struct Shape {
        Box box;
        Vector normal;
    };
    std::vector<Shape> shapes_;  // by face
    // Each range is written by the one thread that splits its node.
    mutable std::vector<uint32_t> order_;
    mutable std::vector<uint64_t> sorted_;  // keys of faces by position along the split axis
    std::unique_ptr<Node[]> nodes_;         // null without faces
    std::unique_ptr<Leaf[]> leaves_;
};

}  // namespace edgegrad
