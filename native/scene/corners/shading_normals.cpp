#include "scene/corners/shading_normals.h"

#include <algorithm>
#include <cmath>

#include "util/double_vector.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

void add(double* p, Vector a) { p[0] += a.x, p[1] += a.y, p[2] += a.z; }

// A face with smooth corners: its corners, M = (p1 - p0) x (p2 - p0), and the angle at each corner, from |a x
// b| (equal at all three) and a . b of the adjacent sides.
struct SmoothFace {
    const int32_t* group;
    const int32_t* vertex;
    Vector p[3], m;
    double length, angle[3], along[3];

    Vector side(int corner, int to) const { return p[(corner + to) % 3] - p[corner]; }
};

// Faces of one mesh: three vertices each, and three groups of corners with a common normal (-1: flat).
template <typename T>
struct MeshFaces {
    const T* vertices;
    const int32_t* faces;
    const int32_t* groups;
    size_t count;
};

MeshFaces<float> faces_of(const SceneTables& t, size_t mesh) {
    const size_t first = 3 * static_cast<size_t>(t.mesh_first_face[mesh]);
    return MeshFaces<float>{t.vertices.data(), t.faces.data() + first, t.corner_normal.data() + first,
                            static_cast<size_t>(t.mesh_first_face[mesh + 1] - t.mesh_first_face[mesh])};
}

template <typename T, typename F>
void for_each_smooth_face(const MeshFaces<T>& mesh, const F& visit) {
    for (size_t f = 0; f < mesh.count; ++f) {
        SmoothFace face;
        face.group = &mesh.groups[3 * f];
        face.vertex = &mesh.faces[3 * f];
        if (face.group[0] < 0 && face.group[1] < 0 && face.group[2] < 0) continue;
        for (int k = 0; k < 3; ++k)
            face.p[k] = vector_at(&mesh.vertices[3 * static_cast<size_t>(face.vertex[k])]);
        face.m = cross(face.side(0, 1), face.side(0, 2));
        face.length = std::sqrt(dot(face.m, face.m));
        if (!(face.length > 0.0)) continue;
        for (int k = 0; k < 3; ++k) {
            face.along[k] = dot(face.side(k, 1), face.side(k, 2));
            face.angle[k] = std::atan2(face.length, face.along[k]);
        }
        visit(face);
    }
}

// For each group of corners, the sum of its faces' unit normals times their angles. `first`: its first group.
template <typename T>
std::vector<double> weighted_sums(const MeshFaces<T>& mesh, int32_t first, size_t groups) {
    std::vector<double> sum(3 * groups, 0.0);
    for_each_smooth_face(mesh, [&](const SmoothFace& face) {
        for (int k = 0; k < 3; ++k)
            if (face.group[k] >= 0)
                add(&sum[3 * static_cast<size_t>(face.group[k] - first)],
                    face.m * (face.angle[k] / face.length));
    });
    return sum;
}

std::vector<double> weighted_sums(const SceneTables& t, size_t mesh) {
    const int32_t first = t.mesh_first_normal[mesh], last = t.mesh_first_normal[mesh + 1];
    return weighted_sums(faces_of(t, mesh), first, static_cast<size_t>(last - first));
}

// The factor that makes a sum a unit vector. If the normals cancel, it is zero, and shading uses the face's
// own normal.
double unit_scale(const double* sum) {
    const double length = std::sqrt(dot(vector_at(sum), vector_at(sum)));
    return length > 0.0 ? 1.0 / length : 0.0;
}

void mesh_normals(SceneTables& t, size_t mesh) {
    const std::vector<double> sum = weighted_sums(t, mesh);
    float* normals = t.normals.data() + 3 * static_cast<ptrdiff_t>(t.mesh_first_normal[mesh]);
    for (size_t n = 0; n < sum.size(); n += 3) {
        const double scale = unit_scale(&sum[n]);
        for (size_t c = 0; c < 3; ++c) normals[n + c] = static_cast<float>(scale * sum[n + c]);
    }
}

// The derivative of a unit vector s/|s| by s is symmetric, so it applies to tangents and to adjoints.
Vector through_normalisation(const double* sum, Vector v) {
    const Vector s = vector_at(sum);
    const double length2 = dot(s, s);
    if (!(length2 > 0.0)) return {};
    return (v - s * (dot(s, v) / length2)) * (1.0 / std::sqrt(length2));
}

template <typename F>
void for_each_computed_mesh(const SceneTables& t, int threads, const F& visit) {
    if (t.mesh_first_normal.empty() || t.mesh_first_normal.back() == 0) return;
    const int64_t meshes = static_cast<int64_t>(t.mesh_first_normal.size()) - 1;
    parallel_for(threads, meshes, nullptr, [&](int, int64_t m) {
        const size_t mesh = static_cast<size_t>(m);
        if (!t.mesh_custom[mesh] && t.mesh_first_normal[mesh + 1] > t.mesh_first_normal[mesh]) visit(mesh);
    });
}

}  // namespace

std::vector<double> angle_weighted_normals(const double* vertices, const int32_t* faces,
                                           const int32_t* groups, size_t face_count, size_t group_count) {
    std::vector<double> sum =
        weighted_sums(MeshFaces<double>{vertices, faces, groups, face_count}, 0, group_count);
    for (size_t n = 0; n < sum.size(); n += 3) {
        const double scale = unit_scale(&sum[n]);
        for (size_t c = 0; c < 3; ++c) sum[n + c] *= scale;
    }
    return sum;
}

void update_shading_normals(SceneTables& t, int threads) {
    if (t.mesh_first_normal.empty() || t.mesh_first_normal.back() == 0) return;
    t.normals.resize(3 * static_cast<size_t>(t.mesh_first_normal.back()));
    for (size_t mesh = 0; mesh + 1 < t.mesh_first_normal.size(); ++mesh)
        if (t.mesh_custom[mesh])
            std::copy(t.custom_normals.begin() + 3 * static_cast<ptrdiff_t>(t.mesh_first_normal[mesh]),
                      t.custom_normals.begin() + 3 * static_cast<ptrdiff_t>(t.mesh_first_normal[mesh + 1]),
                      t.normals.begin() + 3 * static_cast<ptrdiff_t>(t.mesh_first_normal[mesh]));
    for_each_computed_mesh(t, threads, [&](size_t mesh) { mesh_normals(t, mesh); });
}

// With angle = atan2(l, d), l = |M| and d = a . b: d angle = (d dl - l dd)/(l^2 + d^2). Each face adds
// angle/l M to the sums of its corners.
void push_shading_normals(const SceneTables& t, int threads, const double* vertices, double* normals) {
    for_each_computed_mesh(t, threads, [&](size_t mesh) {
        const int32_t first = t.mesh_first_normal[mesh];
        const std::vector<double> sum = weighted_sums(t, mesh);
        std::vector<double> change(sum.size(), 0.0);
        for_each_smooth_face(faces_of(t, mesh), [&](const SmoothFace& f) {
            Vector v[3];
            for (int k = 0; k < 3; ++k) v[k] = vector_at(vertices + 3 * static_cast<ptrdiff_t>(f.vertex[k]));
            const Vector dm = cross(v[1] - v[0], f.side(0, 2)) + cross(f.side(0, 1), v[2] - v[0]);
            const double dl = dot(f.m, dm) / f.length;
            for (int k = 0; k < 3; ++k) {
                if (f.group[k] < 0) continue;
                const Vector da = v[(k + 1) % 3] - v[k], db = v[(k + 2) % 3] - v[k];
                const double dd = dot(da, f.side(k, 2)) + dot(f.side(k, 1), db), d = f.along[k];
                const double turn = (d * dl - f.length * dd) / (f.length * f.length + d * d);
                add(&change[3 * static_cast<size_t>(f.group[k] - first)],
                    dm * (f.angle[k] / f.length) + f.m * ((turn - f.angle[k] * dl / f.length) / f.length));
            }
        });
        for (size_t n = 0; n < sum.size(); n += 3)
            add(normals + 3 * static_cast<ptrdiff_t>(first) + n,
                through_normalisation(&sum[n], vector_at(&change[n])));
    });
}

void pull_shading_normals(const SceneTables& t, int threads, const double* normals, double* vertices) {
    // Meshes share no vertices.
    for_each_computed_mesh(t, threads, [&](size_t mesh) {
        const int32_t first = t.mesh_first_normal[mesh];
        std::vector<double> sum = weighted_sums(t, mesh);
        for (size_t n = 0; n < sum.size(); n += 3) {
            const Vector g =
                through_normalisation(&sum[n], vector_at(normals + 3 * static_cast<ptrdiff_t>(first) + n));
            sum[n] = g.x, sum[n + 1] = g.y, sum[n + 2] = g.z;
        }
        for_each_smooth_face(faces_of(t, mesh), [&](const SmoothFace& f) {
            Vector m{}, p[3]{};
            double l = 0.0;
            for (int k = 0; k < 3; ++k) {
                if (f.group[k] < 0) continue;
                const Vector g = vector_at(&sum[3 * static_cast<size_t>(f.group[k] - first)]);
                const double mg = dot(f.m, g) / f.length, d = f.along[k];
                const double turn = mg / (f.length * f.length + d * d);
                m = m + g * (f.angle[k] / f.length);
                l += turn * d - f.angle[k] * mg / f.length;
                const double along = -turn * f.length;
                const Vector a = f.side(k, 2) * along, b = f.side(k, 1) * along;
                p[(k + 1) % 3] = p[(k + 1) % 3] + a;
                p[(k + 2) % 3] = p[(k + 2) % 3] + b;
                p[k] = p[k] - a - b;
            }
            m = m + f.m * (l / f.length);
            const Vector e1 = cross(f.side(0, 2), m), e2 = cross(m, f.side(0, 1));
            p[1] = p[1] + e1, p[2] = p[2] + e2, p[0] = p[0] - e1 - e2;
            for (int k = 0; k < 3; ++k) add(vertices + 3 * static_cast<ptrdiff_t>(f.vertex[k]), p[k]);
        });
    });
}

}  // namespace edgegrad
