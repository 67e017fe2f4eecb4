// Faces in a tree of boxes, to find those that may cross.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "scene/tables.h"
#include "scene/vector.h"

namespace edgegrad {

// Radians: parts of one mesh whose normals differ by less are taken not to pierce each other, as patches of a
// smooth surface.
constexpr double kOneDirection = 0.9;

struct Box {
    float low[3] = {3e38f, 3e38f, 3e38f}, high[3] = {-3e38f, -3e38f, -3e38f};

    void add(const float* p) {
        for (int c = 0; c < 3; ++c) low[c] = std::min(low[c], p[c]), high[c] = std::max(high[c], p[c]);
    }
    void add(const Box& b) { add(b.low), add(b.high); }
    bool meets(const Box& b) const {
        return low[0] <= b.high[0] && b.low[0] <= high[0] && low[1] <= b.high[1] && b.low[1] <= high[1] &&
               low[2] <= b.high[2] && b.low[2] <= high[2];
    }
};

const float* corner(const SceneTables& t, int32_t face, size_t k);
Box box_of(const SceneTables& t, int32_t face);
Box mesh_box(const SceneTables& t, size_t mesh);
// By some boxes the faces of a mesh whose own box meets them.
std::vector<std::vector<int32_t>> faces_in(const SceneTables& t, int32_t mesh, std::span<const Box> boxes,
                                           int threads);

// Directions about an axis.
struct Cone {
    Vector axis;
    // Of the angle that is left of half of kOneDirection; below -1: none is.
    double cosine, sine;

    Cone() = default;
    Cone(Vector to, double angle);
    // Whether all directions of both are within kOneDirection of each other: the angles that are left are
    // larger than that between the axes.
    bool narrow(const Cone& other) const {
        return cosine > -1.0 && other.cosine > -1.0 &&
               dot(axis, other.axis) > cosine * other.cosine - sine * other.sine;
    }
};

// Faces in a tree of boxes, with the cones of their normals.
class FaceTree {
 public:
    struct Node {
        Box box;
        Cone cone;
        size_t first, last, right;  // right 0: a leaf; the left child comes next

        bool leaf() const { return right == 0; }
    };

    FaceTree(const SceneTables& tables, std::vector<int32_t> faces, int threads);

    // visit(face) for the faces whose boxes meet this one.
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
                for (size_t k = node.first; k < node.last; ++k)
                    if (boxes_[order_[k]].meets(box)) visit_face(faces_[order_[k]]);
            } else {
                stack[top++] = node.right;
                stack[top++] = at + 1;
            }
        }
    }

    // Two nodes by number, or one and itself.
    using Pair = std::array<size_t, 2>;

    // About so many pairs of nodes whose faces' pairs are all that may cross, but for those in patches of
    // about one direction.
    std::vector<Pair> pairs(size_t wanted) const;

    // visit(face, other) for the pairs of two nodes' faces whose boxes meet, but for those in such patches.
    template <typename Visit>
    void visit_pairs(Pair first, const Visit& visit_pair) const {
        std::vector<Pair> stack{first};
        while (!stack.empty()) {
            const Pair pair = stack.back();
            stack.pop_back();
            const Node &s = nodes_[pair[0]], &t = nodes_[pair[1]];
            if (divide(pair, stack) || !s.leaf() || !t.leaf()) continue;
            if (!s.box.meets(t.box) || s.cone.narrow(t.cone)) continue;
            for (size_t j = s.first; j < s.last; ++j)
                for (size_t k = pair[0] == pair[1] ? j + 1 : t.first; k < t.last; ++k)
                    if (boxes_[order_[j]].meets(boxes_[order_[k]]))
                        visit_pair(faces_[order_[j]], faces_[order_[k]]);
        }
    }

 private:
    // Appends the pairs of the nodes' children; false if there are none: leaves, or nothing can cross.
    bool divide(const Pair& pair, std::vector<Pair>& out) const;

    // A node that is to be built, over the faces order_[first] to order_[last - 1]. Its nodes come one after
    // the other, so that subtrees are built at once.
    struct Subtree {
        size_t at, first, last;
    };
    void build(const Subtree& subtree);
    // Makes the node, and appends its children.
    void split(const Subtree& subtree, std::vector<Subtree>& below);

    std::vector<int32_t> faces_;
    std::vector<Box> boxes_;
    std::vector<Vector> normals_;
    std::vector<size_t> order_;
    std::vector<std::pair<float, size_t>> sorted_;  // while it is built: places along an axis, and faces
    std::vector<Node> nodes_;
};

}  // namespace edgegrad
