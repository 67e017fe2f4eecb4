#include "boundary/meshes/solids.h"

#include <algorithm>
#include <numeric>

#include "scene/mesh_edges.h"
#include "scene/mesh_instances.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Whether the face is wound along its edge a -> b. `opposite` is the face's vertex off the edge. Ends are
// compared by distance: welded vertices keep different numbers and may differ by rounding.
bool runs_along(const SceneTables& t, uint32_t face, uint32_t opposite, const float* a, const float* b) {
    const int32_t* f = &t.faces[3 * static_cast<size_t>(face)];
    int k = 0;
    while (k < 2 && static_cast<uint32_t>(f[k]) != opposite) ++k;
    const float* next = &t.vertices[3 * static_cast<size_t>(f[(k + 1) % 3])];
    const auto distance = [&](const float* p) {
        double d = 0.0;
        for (int c = 0; c < 3; ++c)
            d += (static_cast<double>(next[c]) - p[c]) * (static_cast<double>(next[c]) - p[c]);
        return d;
    };
    return distance(a) < distance(b);
}

}  // namespace

std::vector<uint8_t> closed_meshes(const SceneTables& t) {
    std::vector<uint8_t> closed(static_cast<size_t>(t.visible_meshes), 1);
    size_t mesh = 0;
    for (size_t edge = 0; edge + 1 < t.edge_face_first.size(); ++edge) {
        const uint32_t first = t.edge_face_first[edge];
        while (t.edge_faces[first] >= static_cast<uint32_t>(t.mesh_first_face[mesh + 1])) ++mesh;
        if (!closed[mesh]) continue;
        const float* a = &t.vertices[3 * static_cast<size_t>(t.edge_vertices[2 * edge])];
        const float* b = &t.vertices[3 * static_cast<size_t>(t.edge_vertices[2 * edge + 1])];
        closed[mesh] = count_own_faces(t, edge) == 2 &&
                       runs_along(t, t.edge_faces[first], t.edge_opposite[first], a, b) !=
                           runs_along(t, t.edge_faces[first + 1], t.edge_opposite[first + 1], a, b);
    }
    return closed;
}

std::vector<SolidBody> solid_bodies(const SceneTables& t, const std::vector<uint8_t>& closed, int threads) {
    std::vector<SolidBody> bodies(closed.size());
    const auto instances = mesh_instances(t);
    for (size_t mesh = 0; mesh < closed.size(); ++mesh) {
        if (!closed[mesh] || is_placed(instances[mesh])) continue;
        SolidBody& body = bodies[mesh];
        const auto first = static_cast<size_t>(t.mesh_first_vertex[mesh]);
        const auto last = static_cast<size_t>(t.mesh_first_vertex[mesh + 1]);
        const float* origin = &t.vertices[3 * first];
        for (size_t c = 0; c < 3; ++c) body.low[c] = body.high[c] = origin[c];
        for (size_t v = first; v < last; ++v) {
            for (size_t c = 0; c < 3; ++c) {
                body.low[c] = std::min(body.low[c], t.vertices[3 * v + c]);
                body.high[c] = std::max(body.high[c], t.vertices[3 * v + c]);
            }
        }
        const int64_t begin = t.mesh_first_face[mesh], end = t.mesh_first_face[mesh + 1];
        constexpr int64_t kBlock = 1 << 14;  // faces per item of parallel work
        std::vector<double> volume(static_cast<size_t>((end - begin + kBlock - 1) / kBlock), 0.0);
        parallel_for(threads, static_cast<int64_t>(volume.size()), nullptr, [&](int, int64_t block) {
            double sum = 0.0;
            for (int64_t f = begin + block * kBlock; f < std::min(end, begin + (block + 1) * kBlock); ++f) {
                double p[3][3];
                for (int k = 0; k < 3; ++k) {
                    const float* q =
                        &t.vertices[3 * static_cast<size_t>(t.faces[3 * static_cast<size_t>(f) + k])];
                    for (int c = 0; c < 3; ++c) p[k][c] = static_cast<double>(q[c]) - origin[c];
                }
                sum += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                       p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                       p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
            }
            volume[static_cast<size_t>(block)] = sum;
        });
        const double all = std::accumulate(volume.begin(), volume.end(), 0.0);
        body.side = all > 0.0 ? 1 : all < 0.0 ? -1 : 0;
    }
    return bodies;
}

std::vector<int8_t> solid_sides(const std::vector<SolidBody>& bodies, const CameraView& camera) {
    std::vector<int8_t> sides;
    for (const SolidBody& body : bodies) {
        bool inside = true;
        float depth = 0.0f;  // least depth of the bounds
        for (size_t c = 0; c < 3; ++c) {
            const float low = body.low[c] - camera.position[c], high = body.high[c] - camera.position[c];
            inside &= low <= 0.0f && high >= 0.0f;
            depth += std::min(-camera.back[c] * low, -camera.back[c] * high);
        }
        // The camera is inside the body, or the near plane cuts it open.
        sides.push_back(inside || depth <= camera.clip_start ? int8_t{0} : body.side);
    }
    return sides;
}

}  // namespace edgegrad
