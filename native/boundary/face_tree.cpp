#include "boundary/face_tree.h"

#include <cmath>

#include "parallel.h"

namespace edgegrad {
namespace {

constexpr size_t kLeaf = 8;
// Levels of the tree that are built by one thread.
constexpr int kLevels = 4;

// Nodes of a tree over so many faces.
size_t node_count(size_t faces) {
    return faces <= kLeaf ? 1 : 1 + node_count(faces / 2) + node_count(faces - faces / 2);
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

Cone::Cone(Vector to, double angle) : axis(to), cosine(-2.0), sine(0.0) {
    const double left = 0.5 * kOneDirection - angle;
    if (left > 0.0) cosine = std::cos(left), sine = std::sin(left);
}

FaceTree::FaceTree(const SceneTables& tables, std::vector<int32_t> faces, int threads)
    : faces_(std::move(faces)) {
    const size_t count = faces_.size();
    if (count == 0) return;
    boxes_.resize(count), normals_.resize(count), order_.resize(count), sorted_.resize(count);
    constexpr size_t kBlock = 2048;
    parallel_for(threads, static_cast<int64_t>((count + kBlock - 1) / kBlock), nullptr,
                 [&](int, int64_t block) {
                     const size_t first = static_cast<size_t>(block) * kBlock;
                     for (size_t k = first; k < std::min(count, first + kBlock); ++k) {
                         boxes_[k] = box_of(tables, faces_[k]);
                         normals_[k] = unit_normal(tables, faces_[k]);
                         order_[k] = k;
                     }
                 });
    nodes_.resize(node_count(count));
    // The first levels one after the other, then what is below them at once.
    std::vector<Subtree> open{{0, 0, count}};
    for (int level = 0; level < kLevels; ++level) {
        std::vector<Subtree> below;
        for (const Subtree& s : open) split(s, below);
        open = std::move(below);
    }
    parallel_for(threads, static_cast<int64_t>(open.size()), nullptr,
                 [&](int, int64_t k) { build(open[static_cast<size_t>(k)]); });
    sorted_ = {};
}

std::vector<FaceTree::Pair> FaceTree::pairs(size_t wanted) const {
    std::vector<Pair> found;
    if (!nodes_.empty()) found.push_back({0, 0});
    while (!found.empty() && found.size() < wanted) {
        std::vector<Pair> next;
        for (const Pair& pair : found)
            if (!divide(pair, next) && nodes_[pair[0]].leaf() && nodes_[pair[1]].leaf()) next.push_back(pair);
        if (next.size() <= found.size()) return next;
        found = std::move(next);
    }
    return found;
}

bool FaceTree::divide(const Pair& pair, std::vector<Pair>& out) const {
    const auto [a, b] = pair;
    const Node &s = nodes_[a], &t = nodes_[b];
    if ((s.leaf() && t.leaf()) || !s.box.meets(t.box) || s.cone.narrow(t.cone)) return false;
    if (a == b) {
        out.push_back({a + 1, a + 1});
        out.push_back({s.right, s.right});
        out.push_back({a + 1, s.right});
    } else if (t.leaf() || (!s.leaf() && s.last - s.first >= t.last - t.first)) {
        out.push_back({a + 1, b});
        out.push_back({s.right, b});
    } else {
        out.push_back({a, b + 1});
        out.push_back({a, t.right});
    }
    return true;
}

void FaceTree::build(const Subtree& subtree) {
    std::vector<Subtree> below;
    split(subtree, below);
    for (const Subtree& s : below) build(s);
}

void FaceTree::split(const Subtree& subtree, std::vector<Subtree>& below) {
    const auto [at, first, last] = subtree;
    Box box, centres;
    Vector sum{0, 0, 0};
    for (size_t k = first; k < last; ++k) {
        const Box& b = boxes_[order_[k]];
        box.add(b);
        const float c[3] = {b.low[0] + b.high[0], b.low[1] + b.high[1], b.low[2] + b.high[2]};
        centres.add(c);
        sum = sum + normals_[order_[k]];
    }
    const Vector axis = sum * (1.0 / std::max(length(sum), 1e-300));
    double least = 1.0;
    for (size_t k = first; k < last; ++k) least = std::min(least, dot(axis, normals_[order_[k]]));
    nodes_[at] = {box, Cone(axis, std::acos(std::clamp(least, -1.0, 1.0))), first, last, 0};
    if (last - first <= kLeaf) return;
    int axis_of = 0;
    for (int c = 1; c < 3; ++c)
        if (centres.high[c] - centres.low[c] > centres.high[axis_of] - centres.low[axis_of]) axis_of = c;
    const size_t middle = (first + last) / 2;
    for (size_t k = first; k < last; ++k) {
        const Box& b = boxes_[order_[k]];
        sorted_[k] = {b.low[axis_of] + b.high[axis_of], order_[k]};
    }
    const auto place = [&](size_t k) { return sorted_.begin() + static_cast<ptrdiff_t>(k); };
    std::nth_element(place(first), place(middle), place(last));
    for (size_t k = first; k < last; ++k) order_[k] = sorted_[k].second;
    nodes_[at].right = at + 1 + node_count(middle - first);
    below.push_back({at + 1, first, middle});
    below.push_back({nodes_[at].right, middle, last});
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
