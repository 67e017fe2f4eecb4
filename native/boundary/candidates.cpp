#include "boundary/candidates.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

struct V {
    double x, y, z;
};
V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
V cross(V a, V b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(V a) { return std::sqrt(dot(a, a)); }
V vertex(const SceneView& scene, int64_t k) {
    const float* p = scene.vertices + 3 * k;
    return {p[0], p[1], p[2]};
}
V vector(const float* p) { return {p[0], p[1], p[2]}; }

// Faces whose normals differ by less than this sine lie in one plane.
constexpr double kCoplanar = 1e-6;
// Least share of a crease's length that is sampled, however blunt it is: the jump may come from
// shadows rather than from the angle.
constexpr double kLeastCrease = 0.05;

// Cuts [u0, u1] to where a + u (b - a) >= 0; false if nothing is left.
bool clip(double a, double b, double& u0, double& u1) {
    if (a < 0.0 && b < 0.0) return false;
    if (a < 0.0) u0 = std::max(u0, a / (a - b));
    if (b < 0.0) u1 = std::min(u1, a / (a - b));
    return u0 < u1;
}

// Share of an edge's length by which it is sampled: 0 if it can't carry a jump.
double jump_weight(const SceneView& scene, int64_t edge, V camera, V a, V t) {
    const uint32_t first = scene.edge_face_first[edge], last = scene.edge_face_first[edge + 1];
    const V view = cross(a - camera, t);  // normal of the sheet through camera and edge
    V normal[2];
    double side[2];
    int faces = 0;
    for (uint32_t k = first; k < last; ++k) {
        const int32_t* f = scene.faces + 3 * static_cast<int64_t>(scene.edge_faces[k]);
        const V p0 = vertex(scene, f[0]);
        const V m = cross(vertex(scene, f[1]) - p0, vertex(scene, f[2]) - p0);
        const double l = length(m);
        if (l <= 0.0) continue;  // no area, no border
        if (faces < 2) {
            normal[faces] = {m.x / l, m.y / l, m.z / l};
            side[faces] = dot(view, vertex(scene, scene.edge_opposite[k]) - a);
        }
        ++faces;
    }
    if (faces == 0) return 0.0;
    if (faces != 2 || side[0] * side[1] >= 0.0) return 1.0;  // border, junction or silhouette
    const uint32_t* face = scene.edge_faces + first;
    if (scene.face_material[face[0]] != scene.face_material[face[last - first - 1]]) return 1.0;
    const double cosine = dot(normal[0], normal[1]);
    const double sine = length(cross(normal[0], normal[1]));
    if (cosine > 0.0 && sine < kCoplanar) return 0.0;
    return std::clamp(length(normal[0] - normal[1]), kLeastCrease, 1.0);
}

}  // namespace

Candidates primary_candidates(const SceneView& scene, int64_t edge_count) {
    Candidates out;
    const CameraView& c = scene.camera;
    const V origin = vector(c.position), right = vector(c.right), up = vector(c.up), back = vector(c.back);
    for (int64_t edge = 0; edge < edge_count; ++edge) {
        if (!scene.face_moving[scene.edge_faces[scene.edge_face_first[edge]]]) continue;
        const V a = vertex(scene, scene.edge_vertices[2 * edge]);
        const V b = vertex(scene, scene.edge_vertices[2 * edge + 1]);
        // Camera space, depth positive; every clip plane is linear along the edge.
        double x[2], y[2], z[2];
        const V ends[2] = {a - origin, b - origin};
        for (int k = 0; k < 2; ++k) {
            z[k] = -dot(back, ends[k]);
            x[k] = c.focal * dot(right, ends[k]) + c.principal[0] * z[k];   // picture x times depth
            y[k] = -c.focal * dot(up, ends[k]) + c.principal[1] * z[k];
        }
        double u0 = 0.0, u1 = 1.0;
        if (!clip(z[0] - c.clip_start, z[1] - c.clip_start, u0, u1)) continue;
        if (!clip(c.clip_end - z[0], c.clip_end - z[1], u0, u1)) continue;
        if (!clip(x[0], x[1], u0, u1) || !clip(c.width * z[0] - x[0], c.width * z[1] - x[1], u0, u1)) continue;
        if (!clip(y[0], y[1], u0, u1) || !clip(c.height * z[0] - y[0], c.height * z[1] - y[1], u0, u1)) continue;
        double sx[2], sy[2];
        for (int k = 0; k < 2; ++k) {
            const double u = k ? u1 : u0, depth = z[0] + u * (z[1] - z[0]);
            sx[k] = (x[0] + u * (x[1] - x[0])) / depth;
            sy[k] = (y[0] + u * (y[1] - y[0])) / depth;
        }
        const double pixels = std::hypot(sx[1] - sx[0], sy[1] - sy[0]);
        const double mass = pixels * jump_weight(scene, edge, origin, a, b - a);
        if (!(mass > 0.0)) continue;
        out.edge.push_back(static_cast<int32_t>(edge));
        out.u0.push_back(static_cast<float>(u0));
        out.u1.push_back(static_cast<float>(u1));
        out.cumulative.push_back(out.cumulative.back() + mass);
    }
    return out;
}

}  // namespace edgegrad
