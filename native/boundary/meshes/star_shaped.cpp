#include "boundary/meshes/star_shaped.h"

#include <algorithm>
#include <atomic>

#include "boundary/meshes/trees/face_tree.h"
#include "scene/face_vectors.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Tolerances relative to the mesh's size: kNear for face planes close to the
// centre, kRounding for directions close to a face's border.
constexpr double kNear = 1e-6, kRounding = 1e-12;

}  // namespace

bool is_star_shaped(const SceneTables& t, size_t mesh, int threads) {
    const int64_t begin = t.mesh_first_face[mesh], end = t.mesh_first_face[mesh + 1];
    if (begin == end) return false;
    const Box box = mesh_box(t, mesh);
    const Vector low{box.low[0], box.low[1], box.low[2]}, high{box.high[0], box.high[1], box.high[2]};
    const Vector middle = (low + high) * 0.5;
    const double size = length(high - low);
    const auto from_middle = [&](int64_t face, size_t corner) {
        return face_corner(t, static_cast<size_t>(face), corner) - middle;
    };
    const Vector a = from_middle(begin, 0), b = from_middle(begin, 1), c = from_middle(begin, 2);
    const double side = dot(a, cross(b, c)) < 0.0 ? -1.0 : 1.0;
    const Vector way = (a + b + c) * (1.0 / 3.0);
    std::atomic<int> met{0};
    std::atomic<bool> star{true};
    constexpr int64_t kBlock = 1 << 12;  // faces per item of parallel work
    parallel_for(threads, (end - begin + kBlock - 1) / kBlock, nullptr, [&](int, int64_t block) {
        const int64_t first = begin + block * kBlock, last = std::min(end, first + kBlock);
        for (int64_t f = first; f < last && star; ++f) {
            const Vector p = from_middle(f, 0), q = from_middle(f, 1), r = from_middle(f, 2);
            const Vector normal = cross(q - p, r - p);
            if (!(side * dot(normal, p) > kNear * size * length(normal))) star = false;
            // Test whether `way` passes between the planes through the centre and the face's edges.
            const double slack = -kRounding * size * size * size;
            const auto inside = [&](const Vector& u, const Vector& v) {
                return side * dot(way, cross(u, v)) > slack;
            };
            if (inside(p, q) && inside(q, r) && inside(r, p)) ++met;
        }
    });
    return star && met == 1;
}

}  // namespace edgegrad
