#include "boundary/meshes/face_tree.h"

#include <cmath>
#include <limits>

#include "util/parallel.h"

namespace edgegrad {
namespace {

// The number of nodes of a tree over `faces` faces with at most `most` faces per leaf.
size_t node_count(size_t faces, size_t most) {
    return faces <= most ? 1 : 1 + node_count(faces / 2, most) + node_count(faces - faces / 2, most);
}

// Maps a float to an integer so that integers compare as the floats do.
uint32_t ordered(float x) {
    const auto bits = std::bit_cast<uint32_t>(x + 0.0f);  // maps -0 to +0
    return bits >> 31 ? ~bits : bits | 0x80000000u;
}

template <size_t N>
uint32_t bits(const int32_t (&is)[N]) {
    uint32_t all = 0;
    for (size_t k = 0; k < N; ++k) all |= static_cast<uint32_t>(is[k]) << k;
    return all;
}

Vector unit_normal(const SceneTables& t, int32_t face) {
    const auto p = [&](size_t k) -> Vector {
        const float* v = corner(t, face, k);
        return {v[0], v[1], v[2]};
    };
    const Vector m = cross(p(1) - p(0), p(2) - p(0));
    return m * (1.0 / std::max(length(m), 1e-300));
}

}  // namespace

const float* corner(const SceneTables& t, int32_t face, size_t k) {
    return &t.vertices[3 * static_cast<size_t>(t.faces[3 * static_cast<size_t>(face) + k])];
}

Box box_of(const SceneTables& t, int32_t face) {
    Box box;
    for (size_t k = 0; k < 3; ++k) box.add(corner(t, face, k));
    return box;
}

Box mesh_box(const SceneTables& t, size_t mesh) {
    Box box;
    for (int32_t v = t.mesh_first_vertex[mesh]; v < t.mesh_first_vertex[mesh + 1]; ++v)
        box.add(&t.vertices[3 * static_cast<size_t>(v)]);
    return box;
}

MeshBoxes::MeshBoxes(const SceneTables& t) : of(static_cast<size_t>(t.visible_meshes)) {
    for (size_t mesh = 0; mesh < of.size(); ++mesh) of[mesh] = mesh_box(t, mesh);
}

Cone::Cone(Vector to, double angle) : axis(to), cosine(-2.0), sine(0.0) {
    const double left = 0.5 * kOneDirection - angle;
    if (left > 0.0) cosine = std::cos(left), sine = std::sin(left);
}

// The loops compare all faces of a leaf without branches, so that the compiler vectorises them.
uint32_t FaceTree::Leaf::meets(const Box& b) const {
    int32_t is[kLeaf];
    for (size_t k = 0; k < kLeaf; ++k)
        is[k] = (low[0][k] <= b.high[0]) & (b.low[0] <= high[0][k]) & (low[1][k] <= b.high[1]) &
                (b.low[1] <= high[1][k]) & (low[2][k] <= b.high[2]) & (b.low[2] <= high[2][k]);
    return bits(is);
}

uint32_t FaceTree::Leaf::with_vertex(int32_t a, int32_t b, int32_t c) const {
    int32_t is[kLeaf];
    for (size_t k = 0; k < kLeaf; ++k)
        is[k] = (vertex[0][k] == a) | (vertex[0][k] == b) | (vertex[0][k] == c) | (vertex[1][k] == a) |
                (vertex[1][k] == b) | (vertex[1][k] == c) | (vertex[2][k] == a) | (vertex[2][k] == b) |
                (vertex[2][k] == c);
    return bits(is);
}

FaceTree::FaceTree(const SceneTables& tables, std::vector<int32_t> faces, int threads)
    : tables_(tables), threads_(threads), faces_(std::move(faces)) {
    const size_t count = faces_.size();
    if (count == 0) return;
    shapes_.resize(count), order_.resize(count), sorted_.resize(count);
    constexpr size_t kBlock = 2048;
    parallel_for(threads, static_cast<int64_t>((count + kBlock - 1) / kBlock), nullptr,
                 [&](int, int64_t block) {
                     const size_t first = static_cast<size_t>(block) * kBlock;
                     for (size_t k = first; k < std::min(count, first + kBlock); ++k) {
                         shapes_[k] = {box_of(tables, faces_[k]), unit_normal(tables, faces_[k])};
                         order_[k] = static_cast<uint32_t>(k);
                     }
                 });
    const size_t nodes = node_count(count, kLeaf);
    nodes_ = std::make_unique<Node[]>(nodes);
    leaves_ = std::make_unique_for_overwrite<Leaf[]>((nodes + 1) / 2);
    make(0, 0, static_cast<uint32_t>(count), 0);
}

// Splits all nodes that may intersect themselves, one subtree per item of parallel work.
void FaceTree::split_wide() const {
    std::vector<size_t> subtrees;
    if (nodes_) subtrees.push_back(0);
    const auto add_children = [&](size_t at, std::vector<size_t>& to) {
        if (nodes_[at].leaf() || !may_cross({at, at})) return;
        split(at);
        to.push_back(at + 1), to.push_back(nodes_[at].right);
    };
    while (!subtrees.empty() && subtrees.size() < 2 * static_cast<size_t>(threads_)) {
        std::vector<size_t> below;
        for (size_t at : subtrees) add_children(at, below);
        subtrees = std::move(below);
    }
    parallel_for(threads_, static_cast<int64_t>(subtrees.size()), nullptr, [&](int, int64_t k) {
        std::vector<size_t> stack{subtrees[static_cast<size_t>(k)]};
        while (!stack.empty()) {
            const size_t at = stack.back();
            stack.pop_back();
            add_children(at, stack);
        }
    });
}

std::vector<FaceTree::Pair> FaceTree::pairs(size_t requested) const {
    split_wide();
    std::vector<Pair> found;
    if (nodes_) found.push_back({0, 0});
    while (!found.empty() && found.size() < requested) {
        std::vector<Pair> next;
        const auto add = [&](const Pair& pair) { next.push_back(pair); };
        for (const Pair& pair : found) {
            if (both_leaves(pair))
                add(pair);
            else if (may_cross(pair))
                divide(pair, add);
        }
        if (next.size() <= found.size()) return next;
        found = std::move(next);
    }
    return found;
}

void FaceTree::make(size_t at, uint32_t first, uint32_t last, uint32_t first_leaf) const {
    Node& node = nodes_[at];
    node.first = first, node.last = last, node.first_leaf = first_leaf;
    // Bound the faces and their centres
    Box box, centres;
    Vector sum{0, 0, 0};
    for (size_t k = first; k < last; ++k) {
        const auto& [b, normal] = shapes_[order_[k]];
        box.add(b);
        const float c[3] = {b.low[0] + b.high[0], b.low[1] + b.high[1], b.low[2] + b.high[2]};
        centres.add(c);
        sum = sum + normal;
    }
    // Bound the normals by a cone
    const Vector axis = sum * (1.0 / std::max(length(sum), 1e-300));
    // A wider cone is stored as "all directions": it can never be narrow together with another cone.
    constexpr double kWide = 0.89;
    static_assert(kWide < 1.0 - 0.125 * kOneDirection * kOneDirection,
                  "kWide must be below the cosine of kOneDirection / 2");
    double least = 1.0;
    for (size_t k = first; k < last && least > kWide; ++k)
        least = std::min(least, dot(axis, shapes_[order_[k]].normal));
    node.box = box;
    node.cone = Cone(axis, least > kWide ? std::acos(std::min(least, 1.0)) : kOneDirection);
    // Choose the axis along which the node would be split
    for (uint32_t c = 1; c < 3; ++c)
        if (centres.high[c] - centres.low[c] > centres.high[node.axis] - centres.low[node.axis])
            node.axis = c;
    if (node.count() > kLeaf) {
        const uint32_t half = node.count() / 2;
        node.right = static_cast<uint32_t>(at + 1 + node_count(half, kLeaf));
        return;
    }
    // Fill the leaf
    Leaf& leaf = leaves_[first_leaf];
    for (size_t k = 0; k < kLeaf; ++k) {
        const bool any = k < node.count();
        const size_t at_face = any ? order_[first + k] : 0;
        leaf.face[k] = any ? faces_[at_face] : -1;
        for (size_t c = 0; c < 3; ++c) {
            leaf.low[c][k] = any ? shapes_[at_face].box.low[c] : std::numeric_limits<float>::quiet_NaN();
            leaf.high[c][k] = any ? shapes_[at_face].box.high[c] : std::numeric_limits<float>::quiet_NaN();
            leaf.vertex[c][k] = any ? tables_.faces[3 * static_cast<size_t>(leaf.face[k]) + c] : -1;
        }
    }
}

void FaceTree::split_once(size_t at) const {
    std::atomic<uint8_t>& state = nodes_[at].state;
    uint8_t was = kWhole;
    if (state.compare_exchange_strong(was, kBeingSplit)) {
        make_children(at);
        state.store(kSplit);
        state.notify_all();
    } else if (was == kBeingSplit) {
        state.wait(kBeingSplit);
    }
}

void FaceTree::make_children(size_t at) const {
    const Node& node = nodes_[at];
    const uint32_t first = node.first, last = node.last, middle = (first + last) / 2;
    for (size_t k = first; k < last; ++k) {
        const Box& b = shapes_[order_[k]].box;
        sorted_[k] = uint64_t{ordered(b.low[node.axis] + b.high[node.axis])} << 32 | order_[k];
    }
    const auto place = [&](uint32_t k) { return sorted_.begin() + static_cast<ptrdiff_t>(k); };
    std::nth_element(place(first), place(middle), place(last));
    for (size_t k = first; k < last; ++k) order_[k] = static_cast<uint32_t>(sorted_[k]);
    make(at + 1, first, middle, node.first_leaf);
    // A tree of n nodes has (n + 1)/2 leaves.
    const auto left_leaves = static_cast<uint32_t>((node.right - at) / 2);
    make(node.right, middle, last, node.first_leaf + left_leaves);
}

std::vector<std::vector<int32_t>> faces_in(const SceneTables& t, int32_t mesh, std::span<const Box> boxes,
                                           int threads) {
    constexpr int32_t kBlock = 1 << 14;
    const int32_t begin = t.mesh_first_face[static_cast<size_t>(mesh)];
    const int32_t end = t.mesh_first_face[static_cast<size_t>(mesh) + 1];
    std::vector<std::vector<std::vector<int32_t>>> parts(
        static_cast<size_t>((end - begin + kBlock - 1) / kBlock));
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t part) {
        auto& found = parts[static_cast<size_t>(part)];
        found.resize(boxes.size());
        const int32_t first = begin + static_cast<int32_t>(part) * kBlock;
        for (int32_t f = first; f < std::min(end, first + kBlock); ++f) {
            const Box box = box_of(t, f);
            for (size_t k = 0; k < boxes.size(); ++k)
                if (box.meets(boxes[k])) found[k].push_back(f);
        }
    });
    std::vector<std::vector<int32_t>> faces(boxes.size());
    for (const auto& part : parts)
        for (size_t k = 0; k < boxes.size(); ++k)
            faces[k].insert(faces[k].end(), part[k].begin(), part[k].end());
    return faces;
}

}  // namespace edgegrad
