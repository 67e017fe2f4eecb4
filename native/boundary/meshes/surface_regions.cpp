#include "boundary/meshes/surface_regions.h"

#include <numeric>

#include "boundary/meshes/seams.h"
#include "scene/face_vectors.h"
#include "scene/mesh_edges.h"

namespace edgegrad {
namespace {

// Faces whose normals differ by less than this sine lie in one plane.
constexpr double kCoplanar = 1e-6;

// Joins the rings of two edges.
void join_rings(std::vector<int32_t>& next, size_t edges, int32_t one, int32_t other) {
    if (next.empty()) {
        next.resize(edges);
        std::iota(next.begin(), next.end(), 0);
    }
    for (int32_t at = next[static_cast<size_t>(one)]; at != one; at = next[static_cast<size_t>(at)])
        if (at == other) return;
    std::swap(next[static_cast<size_t>(one)], next[static_cast<size_t>(other)]);
}

}  // namespace

bool shading_continues(const SceneTables& t, size_t edge) {
    const uint32_t first = t.edge_face_first[edge];
    if (t.edge_face_first[edge + 1] - first != 2 || count_own_faces(t, edge) != 2) return false;
    const uint32_t one = t.edge_faces[first], other = t.edge_faces[first + 1];
    if (t.face_material[one] != t.face_material[other] || is_smooth(t, one) != is_smooth(t, other))
        return false;
    if (!is_smooth(t, one)) {
        const Vector m = area_normal(t, one), n = area_normal(t, other);
        if (!(dot(m, n) > 0.0) || length(cross(m, n)) >= kCoplanar * length(m) * length(n)) return false;
    }
    return !is_seam(t, static_cast<int64_t>(edge));
}

SurfaceRegions surface_regions(const SceneTables& t) {
    const size_t faces = t.faces.size() / 3, edges = t.edge_vertices.size() / 2;
    SurfaceRegions out;
    out.region.resize(faces);
    out.face_edge.assign(3 * faces, -1);
    out.continues.assign(edges, 0);
    std::iota(out.region.begin(), out.region.end(), 0);
    // Union-find. A region's number is the number of one of its faces.
    const auto root = [&](uint32_t face) {
        auto k = static_cast<int32_t>(face);
        auto& up = out.region;
        while (up[static_cast<size_t>(k)] != k)
            k = up[static_cast<size_t>(k)] = up[static_cast<size_t>(up[static_cast<size_t>(k)])];
        return k;
    };
    for (size_t e = 0; e < edges; ++e) {
        const uint32_t first = t.edge_face_first[e];
        for (uint32_t k = first; k < first + count_own_faces(t, e); ++k) {
            const size_t face = t.edge_faces[k];
            for (size_t c = 0; c < 3; ++c)
                if (t.faces[3 * face + c] == static_cast<int32_t>(t.edge_opposite[k])) {
                    int32_t& known = out.face_edge[3 * face + c];
                    if (known >= 0) join_rings(out.next_on_side, edges, known, static_cast<int32_t>(e));
                    known = static_cast<int32_t>(e);
                }
        }
        if (shading_continues(t, e)) {
            out.continues[e] = 1;
            const int32_t a = root(t.edge_faces[first]), b = root(t.edge_faces[first + 1]);
            out.region[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
        }
    }
    for (size_t f = 0; f < faces; ++f) out.region[f] = root(static_cast<uint32_t>(f));
    return out;
}

}  // namespace edgegrad
