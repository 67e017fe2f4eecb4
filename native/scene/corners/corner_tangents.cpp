#include "scene/corners/corner_tangents.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "util/double_vector.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

constexpr int64_t kFacesAtOnce = 1 << 14;
constexpr uint32_t kListed = 8;  // corners of a vertex for each of its lists

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
    std::unique_ptr<float[]> of_faces;  // of triangles with a flat corner

    explicit CornerNormals(const MappedFaces& faces)
        : mesh(faces), of_faces(std::make_unique_for_overwrite<float[]>(3 * faces.face_count)) {}
    const float* at(size_t corner) const {
        const int32_t group = mesh.smoothing[corner];
        return group < 0 ? &of_faces[corner / 3 * 3] : mesh.normals + 3 * static_cast<size_t>(group);
    }
};

// The corners that begin a tangent. Those of a vertex are in lists, one for every kListed corners of the
// vertex. What corners of a tangent share chooses the list, so that the search stays short at a vertex of
// many tangents, such as a pole whose triangles have a UV coordinate each.
class FirstCorners {
 public:
    // Without tangents, corners of either sign share one.
    FirstCorners(const CornerNormals& normals, const float* tangents)
        : normals_(normals),
          mesh_(normals.mesh),
          tangents_(tangents),
          first_list_(mesh_.vertex_count + 1),
          link_(std::make_unique_for_overwrite<int32_t[]>(3 * mesh_.face_count)) {
        for (size_t corner = 0; corner < 3 * mesh_.face_count; ++corner)
            ++first_list_[static_cast<size_t>(mesh_.faces[corner]) + 1];
        for (size_t v = 0; v < mesh_.vertex_count; ++v)
            first_list_[v + 1] = first_list_[v] + 1 + first_list_[v + 1] / kListed;
        newest_.assign(first_list_.back(), -1);
    }

    // Returns the first corner of a corner's tangent. To be called for all corners in order.
    size_t add(size_t corner) {
        int32_t& newest = newest_[list_of(corner)];
        int32_t found = newest;
        while (found >= 0 && !equal(static_cast<size_t>(found), corner))
            found = kEnd - link_[static_cast<size_t>(found)];
        link_[corner] = found >= 0 ? found : kEnd - newest;
        if (found < 0) found = newest = static_cast<int32_t>(corner);
        return static_cast<size_t>(found);
    }
    size_t operator[](size_t corner) const {
        return link_[corner] < 0 ? corner : static_cast<size_t>(link_[corner]);
    }

 private:
    static constexpr int32_t kEnd = -2;

    bool equal(size_t a, size_t b) const {
        return sign(a) == sign(b) && std::equal(mesh_.uv + 2 * a, mesh_.uv + 2 * a + 2, mesh_.uv + 2 * b) &&
               std::equal(normals_.at(a), normals_.at(a) + 3, normals_.at(b));
    }
    float sign(size_t corner) const { return tangents_ ? tangents_[4 * corner + 3] : 0.0f; }
    size_t list_of(size_t corner) const {
        const size_t vertex = static_cast<size_t>(mesh_.faces[corner]);
        const uint32_t first = first_list_[vertex], count = first_list_[vertex + 1] - first;
        if (count == 1) return first;
        uint64_t key = sign(corner) < 0.0f;
        const auto mix = [&](float value) {  // the two zeros are equal
            key = (key ^ std::bit_cast<uint32_t>(value + 0.0f)) * 0x9E3779B97F4A7C15u;
            key ^= key >> 32;
        };
        std::for_each(mesh_.uv + 2 * corner, mesh_.uv + 2 * corner + 2, mix);
        std::for_each(normals_.at(corner), normals_.at(corner) + 3, mix);
        return first + ((key & 0xFFFFFFFFu) * count >> 32);
    }

    const CornerNormals& normals_;
    const MappedFaces& mesh_;
    const float* tangents_;
    std::vector<uint32_t> first_list_;  // of each vertex
    std::vector<int32_t> newest_;       // last corner of each list; -1: none
    // The first corner of a corner's tangent. Of first corners, kEnd minus the one before it in its list (or
    // minus -1), which is negative.
    std::unique_ptr<int32_t[]> link_;
};

// Whether the triangle's UV coordinates have no area. Single precision decides, as in MikkTSpace.
bool is_collapsed(const float* uv) {
    const float u1 = uv[2] - uv[0], v1 = uv[3] - uv[1], u2 = uv[4] - uv[0], v2 = uv[5] - uv[1];
    return std::abs(u1 * v2 - v1 * u2) <= std::numeric_limits<float>::min();
}

// Writes the normal of a triangle, and what its corners add to their tangents. Collapsed triangles add
// nothing and have no sign.
void add_parts(const MappedFaces& mesh, size_t face, CornerNormals& normals, float* out) {
    Vector p[3];
    for (size_t k = 0; k < 3; ++k)
        p[k] = vector_at(mesh.vertices + 3 * static_cast<size_t>(mesh.faces[3 * face + k]));
    const float* uv = mesh.uv + 6 * face;
    double u1 = double{uv[2]} - uv[0], u2 = double{uv[4]} - uv[0];
    const double v1 = double{uv[3]} - uv[1], v2 = double{uv[5]} - uv[1];
    if (mesh.around) u1 -= std::nearbyint(u1), u2 -= std::nearbyint(u2);
    const double area = u1 * v2 - v1 * u2;
    const bool collapsed = mesh.around ? area == 0.0 : is_collapsed(uv);
    const double sign = collapsed ? 0.0 : area > 0.0 ? 1.0 : -1.0;
    const Vector e1 = p[1] - p[0], e2 = p[2] - p[0];
    const Vector along = (e1 * v2 - e2 * v1) * sign;
    const int32_t* groups = mesh.smoothing + 3 * face;
    if (std::min({groups[0], groups[1], groups[2]}) < 0)
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

// Gives collapsed triangles the sign of the first triangle in order that shares a corner with them, so that
// they share tangents with it. Those without one keep the sign 0.
void sign_collapsed(const CornerNormals& normals, float* tangents) {
    const size_t count = normals.mesh.face_count;
    const auto collapsed = [&](size_t face) { return tangents[12 * face + 3] == 0.0f; };
    std::vector<size_t> faces;
    for (size_t f = 0; f < count; ++f)
        if (collapsed(f)) faces.push_back(f);
    if (faces.empty() || faces.size() == count) return;

    FirstCorners first(normals, nullptr);
    std::vector<int32_t> known(3 * count, -1);  // of first corners: the first triangle with a sign
    for (size_t corner = 0; corner < 3 * count; ++corner) {
        int32_t& face = known[first.add(corner)];
        if (face < 0 && !collapsed(corner / 3)) face = static_cast<int32_t>(corner / 3);
    }
    for (const size_t f : faces) {
        int32_t chosen = -1;
        for (size_t k = 0; k < 3; ++k) {
            const int32_t face = known[first[3 * f + k]];
            if (face >= 0 && (chosen < 0 || face < chosen)) chosen = face;
        }
        if (chosen < 0) continue;
        for (size_t k = 0; k < 3; ++k)
            tangents[12 * f + 4 * k + 3] = tangents[12 * static_cast<size_t>(chosen) + 3];
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

    sign_collapsed(normals, tangents);
    FirstCorners first(normals, tangents);
    for (size_t corner = 0; corner < 3 * mesh.face_count; ++corner) {
        const size_t sum = first.add(corner);
        if (sum == corner) continue;
        for (size_t k = 0; k < 3; ++k) tangents[4 * sum + k] += tangents[4 * corner + k];
    }
    for (size_t corner = 0; corner < 3 * mesh.face_count; ++corner) {
        const size_t shared = first[corner];  // not after `corner`
        const Vector sum = vector_at(tangents + 4 * shared);
        if (shared == corner && length(sum) <= 1e-20) {
            store(tangents + 4 * corner, {1.0, 0.0, 0.0});
            tangents[4 * corner + 3] = -1.0f;
        } else {
            store(tangents + 4 * corner, shared == corner ? unit(sum) : sum);
            tangents[4 * corner + 3] = tangents[4 * shared + 3];
        }
    }
}

}  // namespace edgegrad
