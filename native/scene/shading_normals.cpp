#include "scene/shading_normals.h"

#include <algorithm>
#include <cmath>

#include "parallel.h"

namespace edgegrad {
namespace {

struct Vector {
    double x, y, z;
};
Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector cross(Vector a, Vector b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

void mesh_normals(SceneTables& t, size_t mesh) {
    const int32_t first = t.mesh_first_normal[mesh], last = t.mesh_first_normal[mesh + 1];
    std::vector<double> sum(3 * static_cast<size_t>(last - first), 0.0);
    for (int32_t f = t.mesh_first_face[mesh]; f < t.mesh_first_face[mesh + 1]; ++f) {
        const int32_t* group = &t.corner_normal[3 * static_cast<size_t>(f)];
        if (group[0] < 0 && group[1] < 0 && group[2] < 0) continue;
        Vector p[3];
        for (int k = 0; k < 3; ++k) {
            const float* v = &t.vertices[3 * static_cast<size_t>(t.faces[3 * static_cast<size_t>(f) + k])];
            p[k] = {v[0], v[1], v[2]};
        }
        const Vector m = cross(p[1] - p[0], p[2] - p[0]);
        const double length = std::sqrt(dot(m, m));
        if (!(length > 0.0)) continue;
        for (int k = 0; k < 3; ++k) {
            if (group[k] < 0) continue;
            // The angle between a and b from |a x b| and a . b: |a x b| is the same at all three corners.
            const Vector a = p[(k + 1) % 3] - p[k], b = p[(k + 2) % 3] - p[k];
            const double w = std::atan2(length, dot(a, b)) / length;
            double* s = &sum[3 * static_cast<size_t>(group[k] - first)];
            s[0] += w * m.x, s[1] += w * m.y, s[2] += w * m.z;
        }
    }
    for (int32_t n = first; n < last; ++n) {
        const double* s = &sum[3 * static_cast<size_t>(n - first)];
        const double length = std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
        // Faces that cancel leave no direction; shading then falls back to the face's own normal (zero).
        const double scale = length > 0.0 ? 1.0 / length : 0.0;
        for (int c = 0; c < 3; ++c)
            t.normals[3 * static_cast<size_t>(n) + c] = static_cast<float>(scale * s[c]);
    }
}

}  // namespace

void update_shading_normals(SceneTables& t, int threads) {
    if (t.mesh_first_normal.empty() || t.mesh_first_normal.back() == 0) return;
    t.normals.resize(3 * static_cast<size_t>(t.mesh_first_normal.back()));
    const int64_t meshes = static_cast<int64_t>(t.mesh_first_normal.size()) - 1;
    parallel_for(threads, meshes, nullptr, [&](int, int64_t m) {
        const size_t mesh = static_cast<size_t>(m);
        const auto first = 3 * static_cast<ptrdiff_t>(t.mesh_first_normal[mesh]);
        const auto last = 3 * static_cast<ptrdiff_t>(t.mesh_first_normal[mesh + 1]);
        if (t.mesh_custom[mesh])
            std::copy(t.custom_normals.begin() + first, t.custom_normals.begin() + last,
                      t.normals.begin() + first);
        else if (last > first)
            mesh_normals(t, mesh);
    });
}

}  // namespace edgegrad
