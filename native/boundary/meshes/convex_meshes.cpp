#include "boundary/meshes/convex_meshes.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>

#include "boundary/meshes/trees/face_tree.h"
#include "scene/face_vectors.h"
#include "scene/mesh_edges.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// A point closer to a plane than this, relative to the meshes' size, lies on the plane.
constexpr double kFlat = 1e-6;

struct Plane {
    Vector at, normal;  // unit
};

// The plane of a flat mesh, taken from its largest face. None if the mesh is not flat.
std::optional<Plane> plane_of(const SceneTables& t, size_t mesh) {
    const auto first = static_cast<size_t>(t.mesh_first_face[mesh]);
    const auto last = static_cast<size_t>(t.mesh_first_face[mesh + 1]);
    Plane plane{{0, 0, 0}, {0, 0, 0}};
    for (size_t f = first; f < last; ++f) {
        const Vector m = area_normal(t, f);
        if (dot(m, m) > dot(plane.normal, plane.normal)) plane = {face_corner(t, f, 0), m};
    }
    const double area = length(plane.normal);
    if (!(area > 0.0)) return std::nullopt;
    plane.normal = plane.normal * (1.0 / area);
    double size = 0.0;
    for (size_t f = first; f < last; ++f)
        for (size_t k = 0; k < 3; ++k) size = std::max(size, length(face_corner(t, f, k) - plane.at));
    for (size_t f = first; f < last; ++f)
        for (size_t k = 0; k < 3; ++k)
            if (!(std::abs(dot(plane.normal, face_corner(t, f, k) - plane.at)) <= kFlat * size))
                return std::nullopt;
    return plane;
}

// Whether `sheet` is flat and `other` lies on one side of its plane. `other` may touch the plane.
bool is_one_sided(const SceneTables& t, size_t sheet, size_t other, double slack) {
    const std::optional<Plane> plane = plane_of(t, sheet);
    if (!plane) return false;
    double low = 0.0, high = 0.0;
    for (int32_t v = t.mesh_first_vertex[other]; v < t.mesh_first_vertex[other + 1]; ++v) {
        const float* p = &t.vertices[3 * static_cast<size_t>(v)];
        const double height = dot(plane->normal, Vector{p[0], p[1], p[2]} - plane->at);
        low = std::min(low, height), high = std::max(high, height);
    }
    return low >= -slack || high <= slack;
}

}  // namespace

bool is_connected(const SceneTables& t, size_t mesh) {
    const auto begin = static_cast<uint32_t>(t.mesh_first_face[mesh]);
    size_t parts = static_cast<size_t>(t.mesh_first_face[mesh + 1]) - begin;
    std::vector<uint32_t> parent(parts);
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](uint32_t face) {
        uint32_t f = face - begin;
        while (parent[f] != f) f = parent[f] = parent[parent[f]];
        return f;
    };
    const auto [first_edge, last_edge] = mesh_edges(t, mesh);
    for (auto edge = static_cast<size_t>(first_edge); edge < static_cast<size_t>(last_edge); ++edge) {
        const uint32_t first = t.edge_face_first[edge];
        for (uint32_t k = first + 1; k < first + count_own_faces(t, edge); ++k) {
            const uint32_t a = root(t.edge_faces[first]), b = root(t.edge_faces[k]);
            parts -= a != b;
            parent[b] = a;
        }
    }
    return parts == 1;
}

bool is_convex(const SceneTables& t, size_t mesh, int8_t side, int threads) {
    if (side == 0) return false;
    const auto vertex = [&](uint32_t v, double (&out)[3]) {
        for (int c = 0; c < 3; ++c) out[c] = t.vertices[3 * static_cast<size_t>(v) + c];
    };
    // Rounding can make a flat quad slightly concave: by a part of its size, and, far from the origin, by a
    // part of its coordinates.
    constexpr double kSlack = 1e-6, kRounding = 8.0 / (1 << 24);
    // A face without area has no normal, so a concave edge next to it would go unnoticed.
    constexpr double kSliver = 1e-6;
    const auto has_area = [&](size_t face) {
        double p[3][3];
        for (int k = 0; k < 3; ++k) vertex(static_cast<uint32_t>(t.faces[3 * face + k]), p[k]);
        double a[3], b[3], c[3];
        for (int k = 0; k < 3; ++k)
            a[k] = p[1][k] - p[0][k], b[k] = p[2][k] - p[0][k], c[k] = p[2][k] - p[1][k];
        const double area =
            std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
        const double longest = std::max(
            {std::hypot(a[0], a[1], a[2]), std::hypot(b[0], b[1], b[2]), std::hypot(c[0], c[1], c[2])});
        return area > kSliver * longest * longest;
    };
    const auto bends_out = [&](size_t edge) {
        const uint32_t first = t.edge_face_first[edge];
        const int32_t* f = &t.faces[3 * static_cast<size_t>(t.edge_faces[first])];
        double p[3][3], q[3];
        for (int k = 0; k < 3; ++k) vertex(static_cast<uint32_t>(f[k]), p[k]);
        vertex(t.edge_opposite[first + 1], q);
        double a[3], b[3], d[3];
        for (int c = 0; c < 3; ++c) a[c] = p[1][c] - p[0][c], b[c] = p[2][c] - p[0][c], d[c] = q[c] - p[0][c];
        const double m[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        const double height = m[0] * d[0] + m[1] * d[1] + m[2] * d[2];
        double far = 0.0;
        for (double c : {p[0][0], p[0][1], p[0][2], q[0], q[1], q[2]}) far = std::max(far, std::abs(c));
        const double slack = kSlack * std::hypot(d[0], d[1], d[2]) + kRounding * far;
        return side * height <= slack * std::hypot(m[0], m[1], m[2]);
    };
    // Test the edges first: most meshes have a concave edge, which ends the search early.
    std::atomic<bool> convex{true};
    const auto all = [&](int64_t from, int64_t to, const auto& holds) {
        constexpr int64_t kBlock = 1 << 14;  // edges per item of parallel work
        const int64_t blocks = (to - from + kBlock - 1) / kBlock;
        parallel_for(threads, blocks, nullptr, [&](int, int64_t block) {
            const int64_t first = from + block * kBlock;
            for (int64_t k = first; k < std::min(to, first + kBlock) && convex; ++k)
                if (!holds(static_cast<size_t>(k))) convex = false;
        });
    };
    const auto [first_edge, last_edge] = mesh_edges(t, mesh);
    all(first_edge, last_edge, bends_out);
    all(t.mesh_first_face[mesh], t.mesh_first_face[mesh + 1], has_area);
    return convex;
}

bool is_flat(const SceneTables& t, size_t mesh) { return plane_of(t, mesh).has_value(); }

bool are_apart(const SceneTables& t, size_t one, size_t other) {
    const Box a = mesh_box(t, one), b = mesh_box(t, other);
    double size = 0.0;
    for (const Box* box : {&a, &b}) {
        double square = 0.0;
        for (int c = 0; c < 3; ++c) square += std::pow(static_cast<double>(box->high[c]) - box->low[c], 2);
        size = std::max(size, std::sqrt(square));
    }
    const double slack = kFlat * size;
    for (int c = 0; c < 3; ++c)
        if (a.low[c] >= b.high[c] - slack || b.low[c] >= a.high[c] - slack) return true;
    return is_one_sided(t, one, other, slack) || is_one_sided(t, other, one, slack);
}

}  // namespace edgegrad
