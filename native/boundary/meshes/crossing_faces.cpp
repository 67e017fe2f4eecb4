#include "boundary/meshes/crossing_faces.h"

#include <cmath>
#include <limits>

#include "boundary/meshes/face_cut.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

int common_vertices(const int32_t* a, const int32_t* b) {
    int found = 0;
    for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k) found += a[j] == b[k];
    return found;
}

}  // namespace

std::vector<BoxPair> crossing_faces(const double* vertices, const int32_t* faces, size_t face_count,
                                    int threads) {
    std::vector<Triangle3> triangles;
    std::vector<Box> boxes(face_count);
    triangles.reserve(face_count);
    for (size_t f = 0; f < face_count; ++f) {
        const auto point = [&](size_t k) {
            const double* p = vertices + 3 * int64_t{faces[3 * f + k]};
            return Vector{p[0], p[1], p[2]};
        };
        triangles.emplace_back(point(0), point(1), point(2));
        for (const Vector& p : triangles.back().p) {
            // Rounded outwards, so that no pair is lost
            constexpr float kFar = std::numeric_limits<float>::infinity();
            const double x[3] = {p.x, p.y, p.z};
            float low[3], high[3];
            for (int c = 0; c < 3; ++c) {
                low[c] = std::nextafter(static_cast<float>(x[c]), -kFar);
                high[c] = std::nextafter(static_cast<float>(x[c]), kFar);
            }
            boxes[f].add(low);
            boxes[f].add(high);
        }
    }
    const BoxPairs tree(boxes);
    constexpr size_t kBlock = 256;  // faces per work item
    std::vector<std::vector<BoxPair>> parts((face_count + kBlock - 1) / kBlock);
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t part) {
        std::vector<BoxPair>& out = parts[static_cast<size_t>(part)];
        const size_t first = static_cast<size_t>(part) * kBlock;
        for (size_t a = first; a < std::min(face_count, first + kBlock); ++a) {
            const size_t before = out.size();
            tree.visit(boxes[a], [&](size_t b) {
                Vector ends[2];
                if (a < b && common_vertices(faces + 3 * a, faces + 3 * b) < 2 &&
                    shared_line(triangles[a], triangles[b], ends))
                    out.push_back({a, b});
            });
            std::sort(out.begin() + static_cast<int64_t>(before), out.end());
        }
    });
    std::vector<BoxPair> out;
    for (const std::vector<BoxPair>& part : parts) out.insert(out.end(), part.begin(), part.end());
    return out;
}

}  // namespace edgegrad
