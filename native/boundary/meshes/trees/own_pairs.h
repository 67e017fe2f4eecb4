// The pairs of faces of one mesh that may intersect.
#pragma once

#include <vector>

#include "boundary/meshes/trees/face_tree.h"

namespace edgegrad {

// Radians. Two parts of one mesh whose normals differ by less than this angle are assumed not to intersect,
// as patches of one smooth surface. A smaller angle searches more pairs of faces.
constexpr double kOneDirection = 0.9;

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

// Finds the pairs in the tree of a mesh. Left out are pairs within patches of nearly one direction
// (kOneDirection) and pairs that share a vertex.
class OwnPairs {
 public:
    OwnPairs(const SceneTables& tables, const FaceTree& tree, int threads);

    using Pair = FaceTree::Pair;
    // About `requested` pairs of nodes. Together they cover all pairs of faces.
    std::vector<Pair> parts(size_t requested) const;

    // Calls visit_pair(face, other) for the pairs of faces of two nodes whose boxes overlap.
    template <typename Visit>
    void visit(Pair first, const Visit& visit_pair) const {
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
    const FaceTree::Node& node(size_t k) const { return tree_.nodes_[k]; }
    const FaceTree::Leaf& leaf(size_t k) const { return tree_.leaves_[node(k).first_leaf]; }
    bool both_leaves(const Pair& pair) const { return node(pair[0]).leaf() && node(pair[1]).leaf(); }
    bool may_cross(const Pair& pair) const {
        return node(pair[0]).box.meets(node(pair[1]).box) && !cones_[pair[0]].narrow(cones_[pair[1]]);
    }
    // The node of the pair to replace by its children: the larger one. At least one node is not a leaf.
    size_t divided(const Pair& pair) const {
        const FaceTree::Node &s = node(pair[0]), &t = node(pair[1]);
        return pair[0] != pair[1] && (t.leaf() || (!s.leaf() && s.count() >= t.count())) ? pair[0] : pair[1];
    }

    // Calls add(pair) for the pairs that result when one of the two nodes is replaced by its children.
    template <typename Add>
    void divide(const Pair& pair, const Add& add) const {
        const auto [a, b] = pair;
        const size_t at = divided(pair), right = node(at).right;
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
        const FaceTree::Leaf &s = leaf(pair[0]), &t = leaf(pair[1]);
        const bool one = pair[0] == pair[1];
        FaceTree::for_each_bit(s.meets(node(pair[1]).box), [&](size_t j) {
            uint32_t others = t.meets(s.box(j));
            if (one) others &= ~0u << (j + 1);
            if (others) others &= ~t.with_vertex(s.vertex[0][j], s.vertex[1][j], s.vertex[2][j]);
            FaceTree::for_each_bit(others, [&](size_t k) { visit_pair(s.face[j], t.face[k]); });
        });
    }

    const FaceTree& tree_;
    std::vector<Cone> cones_;  // of the normals of each node's faces
};

}  // namespace edgegrad
