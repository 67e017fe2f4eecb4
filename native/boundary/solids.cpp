#include "boundary/solids.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace edgegrad {
namespace {

// Whether the face is wound along a -> b, an edge of it opposite to its vertex `opposite`. By distance:
// welded vertices have other numbers, and may be a rounding apart.
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
        const uint32_t first = t.edge_face_first[edge], last = t.edge_face_first[edge + 1];
        while (t.edge_faces[first] >= static_cast<uint32_t>(t.mesh_first_face[mesh + 1])) ++mesh;
        if (!closed[mesh]) continue;
        const float* a = &t.vertices[3 * static_cast<size_t>(t.edge_vertices[2 * edge])];
        const float* b = &t.vertices[3 * static_cast<size_t>(t.edge_vertices[2 * edge + 1])];
        closed[mesh] =
            last - first == 2 && runs_along(t, t.edge_faces[first], t.edge_opposite[first], a, b) !=
                                     runs_along(t, t.edge_faces[first + 1], t.edge_opposite[first + 1], a, b);
    }
    return closed;
}

std::vector<int8_t> solid_sides(const SceneTables& t, const std::vector<uint8_t>& closed) {
    std::vector<int8_t> sides(closed.size(), 0);
    for (size_t mesh = 0; mesh < closed.size(); ++mesh) {
        const bool placed = std::find(t.instance_mesh.begin(), t.instance_mesh.end(),
                                      static_cast<int32_t>(mesh)) != t.instance_mesh.end();
        if (!closed[mesh] || placed) continue;
        const auto first = static_cast<size_t>(t.mesh_first_vertex[mesh]);
        const auto last = static_cast<size_t>(t.mesh_first_vertex[mesh + 1]);
        const float* origin = &t.vertices[3 * first];
        bool inside = true;
        float depth = 0.0f;  // least depth of the bounds
        for (size_t c = 0; c < 3; ++c) {
            float low = origin[c], high = origin[c];
            for (size_t v = first; v < last; ++v) {
                low = std::min(low, t.vertices[3 * v + c]);
                high = std::max(high, t.vertices[3 * v + c]);
            }
            inside &= t.camera.position[c] >= low && t.camera.position[c] <= high;
            depth += std::min(-t.camera.back[c] * (low - t.camera.position[c]),
                              -t.camera.back[c] * (high - t.camera.position[c]));
        }
        if (inside || depth <= t.camera.clip_start)
            continue;  // seen from within, or cut open by the near plane
        double volume = 0.0;
        for (int32_t f = t.mesh_first_face[mesh]; f < t.mesh_first_face[mesh + 1]; ++f) {
            double p[3][3];
            for (int k = 0; k < 3; ++k) {
                const float* q =
                    &t.vertices[3 * static_cast<size_t>(t.faces[3 * static_cast<size_t>(f) + k])];
                for (int c = 0; c < 3; ++c) p[k][c] = static_cast<double>(q[c]) - origin[c];
            }
            volume += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                      p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                      p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
        }
        sides[mesh] = volume > 0.0 ? 1 : volume < 0.0 ? -1 : 0;
    }
    return sides;
}

bool connected(const SceneTables& t) {
    const auto faces = static_cast<size_t>(t.mesh_first_face[static_cast<size_t>(t.visible_meshes)]);
    std::vector<uint32_t> parent(faces);
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](uint32_t f) {
        while (parent[f] != f) f = parent[f] = parent[parent[f]];
        return f;
    };
    size_t parts = faces;
    for (size_t edge = 0; edge + 1 < t.edge_face_first.size(); ++edge) {
        const uint32_t first = t.edge_face_first[edge];
        for (uint32_t k = first + 1; k < t.edge_face_first[edge + 1]; ++k) {
            const uint32_t a = root(t.edge_faces[first]), b = root(t.edge_faces[k]);
            parts -= a != b;
            parent[b] = a;
        }
    }
    return parts == 1;
}

bool convex_alone(const SceneTables& t, const std::vector<int8_t>& sides, bool is_connected) {
    if (sides.size() != 1 || sides[0] == 0 || !is_connected) return false;
    const auto vertex = [&](uint32_t v, double (&out)[3]) {
        for (int c = 0; c < 3; ++c) out[c] = t.vertices[3 * static_cast<size_t>(v) + c];
    };
    // Flat quads are concave by a rounding.
    constexpr double kSlack = 1e-6;
    // A face without area has no normal: it could line a concave edge and hide it.
    constexpr double kSliver = 1e-6;
    for (size_t face = 0; face < static_cast<size_t>(t.mesh_first_face[1]); ++face) {
        double p[3][3];
        for (int k = 0; k < 3; ++k) vertex(static_cast<uint32_t>(t.faces[3 * face + k]), p[k]);
        double a[3], b[3], c[3];
        for (int k = 0; k < 3; ++k)
            a[k] = p[1][k] - p[0][k], b[k] = p[2][k] - p[0][k], c[k] = p[2][k] - p[1][k];
        const double area =
            std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
        const double longest = std::max(
            {std::hypot(a[0], a[1], a[2]), std::hypot(b[0], b[1], b[2]), std::hypot(c[0], c[1], c[2])});
        if (!(area > kSliver * longest * longest)) return false;
    }
    for (size_t edge = 0; edge + 1 < t.edge_face_first.size(); ++edge) {
        const uint32_t first = t.edge_face_first[edge];
        const int32_t* f = &t.faces[3 * static_cast<size_t>(t.edge_faces[first])];
        double p[3][3], q[3];
        for (int k = 0; k < 3; ++k) vertex(static_cast<uint32_t>(f[k]), p[k]);
        vertex(t.edge_opposite[first + 1], q);
        double a[3], b[3], d[3];
        for (int c = 0; c < 3; ++c) a[c] = p[1][c] - p[0][c], b[c] = p[2][c] - p[0][c], d[c] = q[c] - p[0][c];
        const double m[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        const double height = m[0] * d[0] + m[1] * d[1] + m[2] * d[2];
        if (sides[0] * height > kSlack * std::hypot(m[0], m[1], m[2]) * std::hypot(d[0], d[1], d[2]))
            return false;
    }
    return true;
}

}  // namespace edgegrad
