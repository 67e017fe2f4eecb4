#include "boundary/meshes/trees/face_tree.h"

#include <limits>

#include "util/parallel.h"

namespace edgegrad {
namespace {

// The number of nodes of a tree over `faces` faces with at most `most` faces per leaf.
size_t node_count(size_t faces, size_t most) {
    return faces <= most ? 1 : 1 + node_count(faces / 2, most) + node_count(faces - faces / 2, most);
}

// The bits of `x` with two zeros between each two.
uint64_t spread(uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffff;
    x = (x | x << 16) & 0x1f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}

// The place of a box's centre on the Morton curve through `all`.
uint64_t morton_code(const Box& box, const Box& all) {
    double extent = 0.0;
    for (int c = 0; c < 3; ++c) extent = std::max(extent, double{all.high[c]} - double{all.low[c]});
    const double scale = extent > 0.0 ? 0x1fffff / extent : 0.0;
    uint64_t code = 0;
    for (int c = 0; c < 3; ++c) {
        const double centre = 0.5 * (double{box.low[c]} + double{box.high[c]});
        code |= spread(static_cast<uint64_t>((centre - double{all.low[c]}) * scale)) << c;
    }
    return code;
}

struct OnCurve {
    uint64_t code;
    int32_t face;
};

// Sorts by code, digit by digit; equal codes keep their order.
void radix_sort(std::vector<OnCurve>& places) {
    constexpr int kBits = 11, kCodeBits = 63;
    std::vector<OnCurve> sorted(places.size());
    for (int shift = 0; shift < kCodeBits; shift += kBits) {
        const auto digit = [&](const OnCurve& p) { return (p.code >> shift) & ((1 << kBits) - 1); };
        std::array<uint32_t, 1 << kBits> next{};
        for (const OnCurve& p : places) ++next[digit(p)];
        uint32_t sum = 0;
        for (uint32_t& n : next) sum += std::exchange(n, sum);
        for (const OnCurve& p : places) sorted[next[digit(p)]++] = p;
        std::swap(places, sorted);
    }
}

template <size_t N>
uint32_t bits(const int32_t (&is)[N]) {
    uint32_t all = 0;
    for (size_t k = 0; k < N; ++k) all |= static_cast<uint32_t>(is[k]) << k;
    return all;
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
    : tables_(tables), faces_(std::move(faces)) {
    const size_t count = faces_.size();
    if (count == 0) return;
    // Sort the faces along the curve
    std::vector<Box> boxes(count);
    parallel_each(threads, count, [&](size_t k) { boxes[k] = box_of(tables, faces_[k]); });
    Box all;
    for (const Box& box : boxes) all.add(box);
    std::vector<OnCurve> places(count);
    parallel_each(threads, count, [&](size_t k) { places[k] = {morton_code(boxes[k], all), faces_[k]}; });
    radix_sort(places);
    for (size_t k = 0; k < count; ++k) faces_[k] = places[k].face;
    // Make the nodes, then bound them from the leaves up
    nodes_.resize(node_count(count, kLeaf));
    leaves_ = std::make_unique_for_overwrite<Leaf[]>((nodes_.size() + 1) / 2);
    make_nodes(0, 0, static_cast<uint32_t>(count), 0);
    parallel_each(threads, nodes_.size(), [&](size_t k) {
        if (nodes_[k].leaf()) fill_leaf(nodes_[k]);
    });
    for (size_t k = nodes_.size(); k-- > 0;) {
        Node& node = nodes_[k];
        if (node.leaf()) continue;
        node.box = nodes_[k + 1].box;
        node.box.add(nodes_[node.right].box);
    }
}

void FaceTree::make_nodes(size_t at, uint32_t first, uint32_t last, uint32_t first_leaf) {
    Node& node = nodes_[at];
    node.first = first, node.last = last, node.first_leaf = first_leaf;
    const uint32_t count = last - first, half = count / 2;
    if (count <= kLeaf) return;
    node.right = static_cast<uint32_t>(at + 1 + node_count(half, kLeaf));
    make_nodes(at + 1, first, first + half, first_leaf);
    // A tree of n nodes has (n + 1)/2 leaves.
    make_nodes(node.right, first + half, last, first_leaf + static_cast<uint32_t>((node.right - at) / 2));
}

void FaceTree::fill_leaf(Node& node) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    Leaf& leaf = leaves_[node.first_leaf];
    for (size_t k = 0; k < kLeaf; ++k) {
        const bool any = k < node.count();
        const int32_t face = leaf.face[k] = any ? faces_[node.first + k] : -1;
        const Box box = any ? box_of(tables_, face) : Box{{kNone, kNone, kNone}, {kNone, kNone, kNone}};
        if (any) node.box.add(box);
        for (size_t c = 0; c < 3; ++c) {
            leaf.low[c][k] = box.low[c], leaf.high[c][k] = box.high[c];
            leaf.vertex[c][k] = any ? tables_.faces[3 * static_cast<size_t>(face) + c] : -1;
        }
    }
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
