#include "boundary/meshes/normals_below.h"

#include <algorithm>
#include <atomic>

#include "scene/face_vectors.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Sine of the angle below the face from which on a normal counts. Smaller ones may be rounding.
constexpr double kBelow = 1e-6;
constexpr int64_t kFaceBlock = 1 << 14;  // faces per item of parallel work

bool points_below(const SceneTables& t, size_t face) {
    const Vector up = area_normal(t, face);
    const double most = -kBelow * length(up);
    for (size_t corner = 0; corner < 3; ++corner) {
        const int32_t normal = t.corner_normal[3 * face + corner];
        if (normal >= 0 && dot(up, vector_at(&t.normals[3 * static_cast<size_t>(normal)])) < most)
            return true;
    }
    return false;
}

}  // namespace

std::vector<uint8_t> normals_below(const SceneTables& tables, int threads) {
    std::vector<std::atomic<uint8_t>> found(tables.material_first_closure.size() - 1);
    const auto faces = static_cast<int64_t>(tables.corner_normal.size() / 3);
    const int64_t items = (faces + kFaceBlock - 1) / kFaceBlock;
    parallel_for(threads, items, nullptr, [&](int, int64_t item) {
        const int64_t end = std::min(faces, (item + 1) * kFaceBlock);
        for (int64_t face = item * kFaceBlock; face < end; ++face) {
            auto& below = found[static_cast<size_t>(tables.face_material[static_cast<size_t>(face)])];
            if (!below.load(std::memory_order_relaxed) && points_below(tables, static_cast<size_t>(face)))
                below.store(1, std::memory_order_relaxed);
        }
    });
    return {found.begin(), found.end()};
}

}  // namespace edgegrad
