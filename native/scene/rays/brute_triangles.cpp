#include "scene/rays/brute_triangles.h"

#include <algorithm>

#include "scene/tables.h"

namespace edgegrad {
namespace {

struct Point {
    double x, y, z;
};

Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Point cross(Point a, Point b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(Point a, Point b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

void put(float* out, Point p) {
    out[0] = static_cast<float>(p.x);
    out[1] = static_cast<float>(p.y);
    out[2] = static_cast<float>(p.z);
}

BruteTriangle prepare(const GeometryTables& tables, int32_t face, int32_t mesh) {
    Point p[3];
    for (size_t k = 0; k < 3; ++k) {
        const float* v =
            &tables.vertices[3 * static_cast<size_t>(tables.faces[3 * static_cast<size_t>(face) + k])];
        p[k] = {v[0], v[1], v[2]};
    }
    BruteTriangle t;
    for (int k = 0; k < 3; ++k) {
        const Point a = p[(k + 1) % 3], b = p[(k + 2) % 3];
        put(t.edge[k], cross(a, b));
        put(t.edge[k] + 3, b - a);
    }
    const Point m = cross(p[1] - p[0], p[2] - p[0]);
    put(t.normal, m);
    t.offset = static_cast<float>(dot(m, p[0]));
    t.face = face;
    t.mesh = mesh;
    t.mask = tables.mesh_mask.empty() ? -1 : tables.mesh_mask[static_cast<size_t>(mesh)];
    return t;
}

double area2(const BruteTriangle& t) {
    const Point m{t.normal[0], t.normal[1], t.normal[2]};
    return dot(m, m);
}

}  // namespace

std::vector<BruteTriangle> all_brute_triangles(const GeometryTables& tables) {
    std::vector<BruteTriangle> triangles;
    for (int32_t m = 0; m < tables.visible_meshes; ++m)
        for (int32_t f = tables.mesh_first_face[static_cast<size_t>(m)];
             f < tables.mesh_first_face[static_cast<size_t>(m) + 1]; ++f)
            triangles.push_back(prepare(tables, f, m));
    // Shadow rays stop at the first hit, which large triangles make most likely.
    std::stable_sort(triangles.begin(), triangles.end(),
                     [](const BruteTriangle& a, const BruteTriangle& b) { return area2(a) > area2(b); });
    return triangles;
}

std::vector<BruteTriangle> brute_triangles(const GeometryTables& tables) {
    const int32_t faces = tables.mesh_first_face[static_cast<size_t>(tables.visible_meshes)];
    if (faces > kBruteForceFaces || !tables.instance_mesh.empty() || !tables.fields.empty()) return {};
    return all_brute_triangles(tables);
}

}  // namespace edgegrad
