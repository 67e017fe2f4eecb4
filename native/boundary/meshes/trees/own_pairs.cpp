#include "boundary/meshes/trees/own_pairs.h"

#include <cmath>

#include "util/parallel.h"

namespace edgegrad {
namespace {

Vector unit_normal(const SceneTables& t, int32_t face) {
    const auto p = [&](size_t k) -> Vector {
        const float* v = corner(t, face, k);
        return {v[0], v[1], v[2]};
    };
    const Vector m = cross(p(1) - p(0), p(2) - p(0));
    return m * (1.0 / std::max(length(m), 1e-300));
}

}  // namespace

Cone::Cone(Vector to, double angle) : axis(to), cosine(-2.0), sine(0.0) {
    const double left = 0.5 * kOneDirection - angle;
    if (left > 0.0) cosine = std::cos(left), sine = std::sin(left);
}

OwnPairs::OwnPairs(const SceneTables& tables, const FaceTree& tree, int threads)
    : tree_(tree), cones_(tree.nodes_.size()) {
    const std::vector<int32_t>& faces = tree.faces_;
    // The sum of the normals of a range of faces is the difference of two of `sums`
    std::vector<Vector> normals(faces.size()), sums(faces.size() + 1);
    parallel_each(threads, faces.size(), [&](size_t k) { normals[k] = unit_normal(tables, faces[k]); });
    for (size_t k = 0; k < normals.size(); ++k) sums[k + 1] = sums[k] + normals[k];
    // A wider cone is stored as "all directions": it can never be narrow together with another cone.
    constexpr double kWide = 0.89;
    static_assert(kWide < 1.0 - 0.125 * kOneDirection * kOneDirection,
                  "kWide must be below the cosine of kOneDirection / 2");
    parallel_each(threads, cones_.size(), [&](size_t at) {
        const FaceTree::Node& node = tree.nodes_[at];
        const Vector sum = sums[node.last] - sums[node.first];
        const Vector axis = sum * (1.0 / std::max(length(sum), 1e-300));
        double least = 1.0;
        for (size_t k = node.first; k < node.last && least > kWide; ++k)
            least = std::min(least, dot(axis, normals[k]));
        cones_[at] = Cone(axis, least > kWide ? std::acos(std::min(least, 1.0)) : kOneDirection);
    });
}

std::vector<FaceTree::Pair> OwnPairs::parts(size_t requested) const {
    std::vector<Pair> found;
    if (!cones_.empty()) found.push_back({0, 0});
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

}  // namespace edgegrad
