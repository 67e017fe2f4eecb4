#include "scene/corners/corner_tangents.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "util/double_vector.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

constexpr int64_t kFacesAtOnce = 1 << 14;

void store(float* p, Vector a) {
    p[0] = static_cast<float>(a.x), p[1] = static_cast<float>(a.y), p[2] = static_cast<float>(a.z);
}
Vector unit(Vector a) {
    const double size = length(a);
    return size > 1e-20 ? a * (1.0 / size) : Vector{};
}
Vector across(Vector a, Vector normal) { return a - normal * dot(a, normal); }

// The normals of corners: those of smooth ones are given, those of flat ones are the triangles'.
struct CornerNormals {
    const MappedFaces& mesh;
    std::vector<float> of_faces;

    explicit CornerNormals(const MappedFaces& faces) : mesh(faces), of_faces(3 * faces.face_count) {}
    const float* at(size_t corner) const {
        const int32_t group = mesh.smoothing[corner];
        return group < 0 ? &of_faces[corner / 3 * 3] : mesh.normals + 3 * static_cast<size_t>(group);
    }
};

// Writes the normal of a triangle, and what its corners add to their tangents.
void add_parts(const MappedFaces& mesh, size_t face, CornerNormals& normals, float* out) {
    Vector p[3];
    for (size_t k = 0; k < 3; ++k)
        p[k] = vector_at(mesh.vertices + 3 * static_cast<size_t>(mesh.faces[3 * face + k]));
    const float* uv = mesh.uv + 6 * face;
    double u1 = double{uv[2]} - uv[0], u2 = double{uv[4]} - uv[0];
    const double v1 = double{uv[3]} - uv[1], v2 = double{uv[5]} - uv[1];
    if (mesh.around) u1 -= std::nearbyint(u1), u2 -= std::nearbyint(u2);
    const double sign = u1 * v2 - v1 * u2 >= 0.0 ? 1.0 : -1.0;
    const Vector e1 = p[1] - p[0], e2 = p[2] - p[0], along = (e1 * v2 - e2 * v1) * sign;
    store(&normals.of_faces[3 * face], unit(cross(e1, e2)));
    for (size_t k = 0; k < 3; ++k) {
        const Vector normal = vector_at(normals.at(3 * face + k));
        const Vector ahead = across(p[(k + 1) % 3] - p[k], normal);
        const Vector back = across(p[(k + 2) % 3] - p[k], normal);
        const double sizes = std::sqrt(dot(ahead, ahead) * dot(back, back));
        const double cosine = sizes > 0.0 ? dot(ahead, back) / sizes : 0.0;
        const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
        store(out + 4 * k, unit(across(along, normal)) * angle);
        out[4 * k + 3] = static_cast<float>(sign);
    }
}

}  // namespace

void corner_tangents(const MappedFaces& mesh, int threads, float* tangents) {
    CornerNormals normals(mesh);
    const int64_t count = static_cast<int64_t>(mesh.face_count);
    parallel_for(threads, (count + kFacesAtOnce - 1) / kFacesAtOnce, nullptr, [&](int, int64_t chunk) {
        const int64_t end = std::min(count, (chunk + 1) * kFacesAtOnce);
        for (int64_t f = chunk * kFacesAtOnce; f < end; ++f)
            add_parts(mesh, static_cast<size_t>(f), normals, tangents + 12 * f);
    });

    // The first corner of each tangent has the sum. The first corners of a vertex are a list: the last one
    // that was found, and the one before each.
    std::vector<int32_t> last(mesh.vertex_count, -1), before(3 * mesh.face_count), first(before.size());
    const auto equal = [&](size_t a, size_t b) {
        return tangents[4 * a + 3] == tangents[4 * b + 3] &&
               std::equal(mesh.uv + 2 * a, mesh.uv + 2 * a + 2, mesh.uv + 2 * b) &&
               std::equal(normals.at(a), normals.at(a) + 3, normals.at(b));
    };
    for (size_t corner = 0; corner < first.size(); ++corner) {
        int32_t& newest = last[static_cast<size_t>(mesh.faces[corner])];
        int32_t found = newest;
        while (found >= 0 && !equal(static_cast<size_t>(found), corner))
            found = before[static_cast<size_t>(found)];
        if (found < 0) {
            before[corner] = newest;
            found = newest = static_cast<int32_t>(corner);
        } else {
            for (size_t k = 0; k < 3; ++k)
                tangents[4 * static_cast<size_t>(found) + k] += tangents[4 * corner + k];
        }
        first[corner] = found;
    }
    for (size_t corner = 0; corner < first.size(); ++corner) {
        const size_t shared = static_cast<size_t>(first[corner]);  // not after `corner`
        const Vector tangent = vector_at(tangents + 4 * shared);
        store(tangents + 4 * corner, shared == corner ? unit(tangent) : tangent);
    }
}

}  // namespace edgegrad
