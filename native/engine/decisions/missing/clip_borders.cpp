#include "engine/decisions/missing/clip_borders.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

// Whether the border at one clip distance may be in the picture. seen(vertex, at) sets a vertex's place in
// the camera's axes and returns its depth.
template <typename Seen>
bool shows_cut(const CameraView& c, const SceneTables& t, size_t mesh, double clip, const Seen& seen) {
    if (is_panorama(c.kind)) return true;
    const double scale = c.kind == kOrthographic ? c.focal : c.focal / std::max(clip, 1e-9);
    double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
    for (auto f = static_cast<size_t>(t.mesh_first_face[mesh]);
         f < static_cast<size_t>(t.mesh_first_face[mesh + 1]); ++f)
        for (size_t k = 0; k < 3; ++k) {
            double a[3], b[3];
            const double from = seen(static_cast<size_t>(t.faces[3 * f + k]), a),
                         to = seen(static_cast<size_t>(t.faces[3 * f + (k + 1) % 3]), b);
            if ((from < clip) == (to < clip)) continue;
            const double share = (clip - from) / (to - from);
            for (int i = 0; i < 2; ++i) {
                const double x = scale * (a[i] + share * (b[i] - a[i]));
                low[i] = std::min(low[i], x), high[i] = std::max(high[i], x);
            }
        }
    // A line between two such points may cross the picture even if both are outside. One picture's width
    // of slack contains all shifts of the camera.
    const double reach = std::max(c.full_width, c.full_height);
    return low[0] < reach && low[1] < reach && high[0] > -reach && high[1] > -reach;
}

}  // namespace

bool may_be_cut(const CameraView& c, const Box& box) {
    double nearest = 0.0, farthest = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double low = static_cast<double>(box.low[k]) - c.position[k],
                     high = static_cast<double>(box.high[k]) - c.position[k];
        if (is_panorama(c.kind)) {
            const double least = std::max({low, -high, 0.0}), most = std::max(-low, high);
            nearest += least * least, farthest += most * most;
        } else {
            nearest += std::min(-c.back[k] * low, -c.back[k] * high);
            farthest += std::max(-c.back[k] * low, -c.back[k] * high);
        }
    }
    if (is_panorama(c.kind)) nearest = std::sqrt(nearest), farthest = std::sqrt(farthest);
    const double slack = 1e-9 * std::max(std::abs(nearest), std::abs(farthest));
    const auto within = [&](double clip) { return nearest - slack < clip && clip <= farthest + slack; };
    return within(c.clip_start) || within(c.clip_end);
}

bool is_cut(const CameraView& c, const SceneTables& t, size_t mesh) {
    const bool panorama = is_panorama(c.kind);
    const auto seen = [&](size_t vertex, double (&at)[3]) {
        const float* p = &t.vertices[3 * vertex];
        const double d[3] = {p[0] - static_cast<double>(c.position[0]),
                             p[1] - static_cast<double>(c.position[1]),
                             p[2] - static_cast<double>(c.position[2])};
        const float* axes[3] = {c.right, c.up, c.back};
        for (int k = 0; k < 3; ++k) at[k] = d[0] * axes[k][0] + d[1] * axes[k][1] + d[2] * axes[k][2];
        return panorama ? std::sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]) : -at[2];
    };
    double nearest = 1e300, farthest = -1e300, at[3];
    for (int32_t v = t.mesh_first_vertex[mesh]; v < t.mesh_first_vertex[mesh + 1]; ++v) {
        const double depth = seen(static_cast<size_t>(v), at);
        nearest = std::min(nearest, depth), farthest = std::max(farthest, depth);
    }
    for (const double clip : {static_cast<double>(c.clip_start), static_cast<double>(c.clip_end)})
        if (nearest < clip && clip <= farthest && shows_cut(c, t, mesh, clip, seen)) return true;
    return false;
}

}  // namespace edgegrad
