#include "boundary/meshes/seams.h"

#include <algorithm>
#include <cmath>

#include "scene/closure_programs.h"
#include "scene/face_vectors.h"
#include "scene/material_params.h"
#include "scene/mesh_edges.h"

namespace edgegrad {
namespace {

// Relative difference below which two values count as equal.
constexpr float kSame = 1e-5f;

// The corner of a face at a given point. It is found by distance, because welded vertices keep several
// numbers.
int nearest_corner(const SceneTables& t, uint32_t face, const float* point) {
    int best = 0;
    float least = 3e38f;
    for (int k = 0; k < 3; ++k) {
        const float* p =
            &t.vertices[3 * static_cast<size_t>(t.faces[3 * size_t{face} + static_cast<size_t>(k)])];
        const float d = std::hypot(p[0] - point[0], p[1] - point[1], p[2] - point[2]);
        if (d < least) least = d, best = k;
    }
    return best;
}

bool differ(const float* a, const float* b, int count) {
    for (int k = 0; k < count; ++k)
        if (std::abs(a[k] - b[k]) > kSame * std::max(1.0f, std::abs(a[k]))) return true;
    return false;
}

bool normals_differ(const SceneTables& t, const uint32_t (&face)[2], const int (&corner)[2]) {
    if (t.corner_normal.empty()) return false;
    int32_t n[2];
    for (size_t k = 0; k < 2; ++k)
        n[k] = t.corner_normal[3 * size_t{face[k]} + static_cast<size_t>(corner[k])];
    if (n[0] == n[1]) return false;
    if (n[0] < 0 || n[1] < 0) return true;  // one face is flat-shaded
    return differ(&t.normals[3 * static_cast<size_t>(n[0])], &t.normals[3 * static_cast<size_t>(n[1])], 3);
}

// Whether the material's shaders read attributes. Sets `slope` if they also read attribute derivatives along
// the surface.
bool reads_attributes(const SceneTables& t, int32_t material, bool& slope) {
    const TextureTables& x = t.textures;
    if (x.program_first.size() <= 1) return false;
    bool reads = false;
    for (int32_t closure = t.material_first_closure[static_cast<size_t>(material)];
         closure < t.material_first_closure[static_cast<size_t>(material) + 1]; ++closure) {
        const auto k = static_cast<size_t>(closure);
        reads |= x.closure_program[k] >= 0 || x.closure_weight_program[k] >= 0;
        slope |= (k < x.closure_uv.size() && x.closure_uv[k] >= 0) ||
                 (k < x.closure_tangent.size() && x.closure_tangent[k] >= 0);
    }
    return reads || slope;
}

bool attributes_differ(const SceneTables& t, const uint32_t (&face)[2], const int (&corner)[2]) {
    const TextureTables& x = t.textures;
    const size_t meshes = x.mesh_extent.size() / kMeshExtent;
    if (meshes == 0 || face[0] >= x.face_mesh.size()) return false;
    const auto mesh = static_cast<size_t>(x.face_mesh[face[0]]);
    for (size_t a = 0; a * meshes < x.mesh_attributes.size(); ++a) {
        const TextureAttribute& attribute = x.mesh_attributes[a * meshes + mesh];
        if (attribute.components <= 0) continue;  // both faces are of one instance
        const auto at = [&](int k) {
            return x.attributes.data() + attribute.offset +
                   (3 * int64_t{face[k]} + corner[k]) * attribute.components;
        };
        if (differ(at(0), at(1), attribute.components)) return true;
    }
    return false;
}

// Whether the material's transparency depends on a normal: on the shading normal, if that is discontinuous
// here (not `smooth`), or on the geometric normal.
bool lets_through_by_normal(const SceneTables& t, int32_t material, bool smooth) {
    const auto reads = [smooth](const TextureInstruction& step) {
        return step.op == static_cast<int32_t>(TextureOp::TRUE_NORMAL) ||
               (!smooth && step.op == static_cast<int32_t>(TextureOp::NORMAL));
    };
    return any_closure(t, static_cast<size_t>(material), [&](size_t closure) {
        return (t.closure_flags[closure] & kHasTransparency) && any_step(t, closure, reads);
    });
}

// Whether a program bends the normal by what varies along the face's own plane.
bool bends_normals(const SceneTables& t, int32_t material) {
    const auto bends = [](const TextureInstruction& step) {
        return step.op == static_cast<int32_t>(TextureOp::SURFACE_TANGENT) ||
               step.op == static_cast<int32_t>(TextureOp::NORMAL_MAP);
    };
    return any_closure(t, static_cast<size_t>(material),
                       [&](size_t closure) { return any_step(t, closure, bends); });
}

// Whether two faces lie in one plane, with equal or opposite orientation.
bool in_one_plane(const SceneTables& t, const uint32_t (&face)[2]) {
    const Vector n[2] = {area_normal(t, face[0]), area_normal(t, face[1])};
    const Vector across = cross(n[0], n[1]);
    return dot(across, across) <= double{kSame} * kSame * dot(n[0], n[0]) * dot(n[1], n[1]);
}

}  // namespace

bool is_seam(const SceneTables& t, int64_t edge) {
    const auto e = static_cast<size_t>(edge);
    const uint32_t first = t.edge_face_first[e];
    if (t.edge_face_first[e + 1] - first < 2) return false;  // a border
    const uint32_t face[2] = {t.edge_faces[first], t.edge_faces[first + 1]};
    bool slope = false;
    const bool reads = reads_attributes(t, t.face_material[face[0]], slope);
    if (slope) return true;  // tangents are constant per face
    if (bends_normals(t, t.face_material[face[0]]) && !in_one_plane(t, face)) return true;
    if (t.corner_normal.empty() && !reads) return false;
    if (count_own_faces(t, e) < 2) return true;  // attributes of different meshes are not compared
    if (reads) {
        const auto is_smooth = [&t](uint32_t f) {
            const auto at = 3 * size_t{f};
            return !t.corner_normal.empty() && t.corner_normal[at] >= 0 && t.corner_normal[at + 1] >= 0 &&
                   t.corner_normal[at + 2] >= 0;
        };
        const bool smooth = is_smooth(face[0]) && is_smooth(face[1]);
        if (lets_through_by_normal(t, t.face_material[face[0]], smooth) && !in_one_plane(t, face))
            return true;
    }
    for (size_t end = 0; end < 2; ++end) {
        const float* p = &t.vertices[3 * size_t{t.edge_vertices[2 * e + end]}];
        const int corner[2] = {nearest_corner(t, face[0], p), nearest_corner(t, face[1], p)};
        if (normals_differ(t, face, corner) || (reads && attributes_differ(t, face, corner))) return true;
    }
    return false;
}

}  // namespace edgegrad
