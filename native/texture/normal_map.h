// Normal maps, and the tangents of normal maps and anisotropy (Cycles' svm_node_normal_map and
// primitive_tangent).
#pragma once

#include "scene/geometry.h"
#include "texture/image.h"
#include "texture/point.h"

namespace edgegrad::EDGEGRAD_ISA {

// Tangent of a UV map along u, not normalised, in the mesh's object space. `sign` is that of the bitangent.
struct UvTangent {
    Mask known;
    Vec3 tangent;
    Float sign;
};

EG_INLINE Vec3 normalized_or(Vec3 v, Vec3 fallback) {
    const Float length2 = dot(v, v);
    const Mask fine = (length2 > 1e-30f) & (length2 < 1e30f);
    return select(fine, v * (1.0f / sqrt(select(fine, length2, 1.0f))), fallback);
}

// M^T v for the linear part M of the instance transforms: a normal in object space, up to its length.
EG_INLINE Vec3 normal_to_mesh(const SceneView& scene, Int instance, Vec3 v) {
    const Mask placed = instance >= 0;
    if (!any(placed)) return v;
    const Placement m = gather_placement(scene, instance);
    return select(placed, m.x * v.x + m.y * v.y + m.z * v.z, v);
}

// M^-T v up to a positive factor: an object-space normal in the world.
EG_INLINE Vec3 normal_to_world(const SceneView& scene, Int instance, Vec3 v) {
    const Mask placed = instance >= 0;
    return any(placed) ? select(placed, place_normal(gather_placement(scene, instance), v), v) : v;
}

// Length of the interpolated corner normals, which tangent space does not normalise; 1 where the surface is
// flat.
EG_INLINE Float interpolated_length(const SceneView& scene, Mask active, const TexturePoint& point) {
    if (!scene.corner_normal) return splat(1.0f);
    Mask smooth;
    const Vec3 n = interpolated_normal(scene, active, point.face, point.b1, point.b2, smooth);
    const Float length2 = dot(n, n);
    return sqrt(select(smooth & (length2 > 0.0f), length2, 1.0f));
}

// Gives lanes without an index that of a lane that has one, so that all can be read.
EG_INLINE Int fill_lanes(Mask known, Int index) {
    int lane = 0;
    while (!known[lane]) ++lane;
    return select(known, index, splat(static_cast<int>(index[lane])));
}

// The attributes of the UV maps, which may differ from lane to lane (-1: none), and of their tangents
// ("NAME.tangent").
struct UvMap {
    Int uv, tangent;
};

EG_INLINE UvMap uv_map(const TextureView& textures, Int closure) {
    if (!textures.closure_uv) return {splat(-1), splat(-1)};
    return {gather(textures.closure_uv, closure), gather(textures.closure_tangent, closure)};
}

// Uses the mesh's tangents if it has them. Otherwise uses the triangle's tangent along u, projected to be
// orthogonal to the normal n (in object space).
EG_INLINE UvTangent uv_tangent(const SceneView& scene, Mask active, const UvMap& map,
                               const TexturePoint& point, Vec3 n) {
    const TextureView& textures = scene.textures;
    active &= ~on_field(scene, active, point.face);  // fields have no UV maps
    UvTangent r{splat(0), zero3(), splat(1.0f)};
    const Int face = select(active, point.face, splat(0));
    Mask made = splat(0), own = splat(0);  // lanes with stored tangents, lanes with UVs only
    Int at = splat(0), step = splat(0);    // position of the face's first float, and floats per corner
    // Find the attributes of each lane
    for (int i = 0; i < W; ++i) {
        if (!active[i] || map.uv[i] < 0) continue;
        const int32_t mesh = textures.face_mesh[face[i]];
        const auto attribute = [&](int32_t number) -> const TextureAttribute& {
            return textures.mesh_attributes[number * textures.mesh_count + mesh];
        };
        const TextureAttribute& tangents = attribute(map.tangent[i]);
        const TextureAttribute& uv = attribute(map.uv[i]);
        const auto take = [&](const TextureAttribute& a, Mask& lanes) {
            lanes[i] = -1;
            at[i] = static_cast<int32_t>(a.offset + static_cast<int64_t>(face[i]) * 3 * a.components);
            step[i] = a.components;
        };
        if (tangents.components == 4)
            take(tangents, made);
        else if (uv.components >= 2)
            take(uv, own);
    }
    // Interpolate stored tangents
    if (any(made)) {
        const Int index = fill_lanes(made, at);
        Rows corner[3];
        for (int k = 0; k < 3; ++k) store(corner[k], index + 4 * k);
        const Float weight[3] = {1.0f - point.b1 - point.b2, point.b1, point.b2};
        const Color4 t = sum_texels(textures.attributes, corner, weight, 4);
        r.tangent = select(made, Vec3{t.c[0], t.c[1], t.c[2]}, zero3());
        r.sign = select(made, t.c[3], 1.0f);  // between -1 and 1 where the corners' signs differ
        r.known = made;
    }
    // Compute the triangle's tangent from its UVs
    if (any(own)) {
        const Int index = fill_lanes(own, at);
        const auto uv = [&](int corner, int axis) {
            return gather(textures.attributes + axis, index + select(own, step, splat(0)) * corner);
        };
        const Float u0 = uv(0, 0), v0 = uv(0, 1);
        const Float u1 = uv(1, 0) - u0, v1 = uv(1, 1) - v0, u2 = uv(2, 0) - u0, v2 = uv(2, 1) - v0;
        const Float det = difference_of_products(u1, v2, u2, v1);
        own &= det != 0.0f;
        const Float turn = select(det < 0.0f, splat(-1.0f), 1.0f);
        const Triangle t = gather_triangle(scene, face);
        const Vec3 along = ((t.p1 - t.p0) * v2 - (t.p2 - t.p0) * v1) * turn;
        const Vec3 flat = along - n * (dot(n, along) / max(dot(n, n), 1e-30f));
        r.tangent = select(own, normalized_or(flat, zero3()), r.tangent);
        r.sign = select(own, turn, r.sign);
        r.known |= own;
    }
    return r;
}

// The smooth normal, bent by a normal map with the colour `color` in [0, 1]. Unit, on the viewer's side of
// the surface. `point.normal` where the mesh has no UV map for it. As in Cycles, the map takes the place of
// the bump of the material's displacement.
EG_INLINE Vec3 mapped_normal(const SceneView& scene, Mask active, const UvMap& map, const TexturePoint& point,
                             Vec3 color, Float strength) {
    if (!any(active)) return point.normal;
    const Vec3 front = select(point.backside, -point.undisplaced, point.undisplaced);
    const Float length = interpolated_length(scene, active, point);
    const Vec3 n = normalized_or(normal_to_mesh(scene, point.instance, front), front) * length;
    const UvTangent t = uv_tangent(scene, active, map, point, n);
    const Vec3 bitangent = cross(n, t.tangent) * t.sign;
    const Float x = (2.0f * color.x - 1.0f) * strength, y = (2.0f * color.y - 1.0f) * strength;
    const Float share = min(max(strength, 0.0f), splat(1.0f));
    const Float z = 1.0f + share * ((2.0f * color.z - 1.0f) - 1.0f);
    const Vec3 bent = t.tangent * x + bitangent * y + n * z;
    Vec3 r = normalized_or(normal_to_world(scene, point.instance, bent), front);
    r = select(point.backside, -r, r);
    return select(active & t.known, r, point.normal);
}

EG_INLINE Mask is_same(Vec3 a, Vec3 b) { return (a.x == b.x) & (a.y == b.y) & (a.z == b.z); }

// Whether light along wi would pass from one side of the smooth surface to the other, or back, by reflection
// or refraction at the bent normal.
EG_INLINE Mask leaks(Vec3 smooth, Vec3 bent, Vec3 wi) {
    return ~is_same(smooth, bent) & (dot(smooth, wi) * dot(smooth, bent) * dot(bent, wi) < 0.0f);
}

// Factor of light along wi on the bent normal of a diffuse lobe. It removes light from behind the smooth
// surface and softens the terminator (Conty Estevez, Lecocq and Stein 2019, "A Microfacet-Based Shadowing
// Function to Solve the Bump Terminator Problem").
EG_INLINE Float bump_shadowing(Vec3 smooth, Vec3 bent, Vec3 wi) {
    const Float cos_i = dot(smooth, wi), cos_d = dot(smooth, bent);
    const Float i2 = min(cos_i * cos_i, splat(1.0f)), d2 = min(cos_d * cos_d, splat(1.0f));
    const Float alpha2 = min(0.125f * (1.0f / max(d2, 1e-12f) - 1.0f), splat(1.0f));
    // Smith's G1 of GGX.
    const Float g = 2.0f / (1.0f + sqrt(1.0f + alpha2 * (1.0f / max(i2, 1e-12f) - 1.0f)));
    Float r = select(d2 < 1.0f, select(i2 < 1e-12f, splat(0.0f), g), 1.0f);
    r = select(leaks(smooth, bent, wi), splat(0.0f), r);
    return select(is_same(smooth, bent), splat(1.0f), r);
}

// The least size of a bounding box along an axis, metres (BKE_mesh_texspace_calc).
constexpr float kLeastBoxSize = 2e-5f;

// Unit direction of anisotropy, orthogonal to the normal n: along u of the closure's UV map, or, without one,
// around the z axis of the mesh's bounding box, like Cycles with generated coordinates.
EG_INLINE Vec3 surface_tangent(const SceneView& scene, Mask active, Int closure, const TexturePoint& point,
                               Vec3 n) {
    const Vec3 front = select(point.backside, -n, n);
    const Vec3 in_mesh = normal_to_mesh(scene, point.instance, front);
    const UvTangent t = uv_tangent(scene, active, uv_map(scene.textures, closure), point, in_mesh);
    Vec3 direction = t.tangent;
    const Mask radial = active & ~t.known;
    if (any(radial) && scene.textures.mesh_extent && scene.textures.mesh_count > 0) {
        const Int face = select(active, point.face, splat(0));
        const Vec3 p = interpolate(gather_triangle(scene, face), point.b1, point.b2);
        // The box moves with the vertices at its ends
        const Int row = gather(scene.textures.face_mesh, face) * kMeshExtent;
        const auto coordinate = [&](int k) {
            return gather(scene.vertices, gather(scene.textures.mesh_extent + k, row));
        };
        const auto from_center = [&](Float x, int axis) {
            const Float size = max(coordinate(4 * axis + 3) - coordinate(4 * axis + 2), splat(kLeastBoxSize));
            return (x - 0.5f * (coordinate(4 * axis) + coordinate(4 * axis + 1))) / size;
        };
        direction = select(radial, Vec3{-from_center(p.y, 1), from_center(p.x, 0), splat(0.0f)}, direction);
    }
    direction = normal_to_world(scene, point.instance, direction);
    Vec3 a, b;
    basis(n, a, b);
    // Of a direction along the normal only rounding is left, whose direction and derivative are noise
    constexpr float kRounding = 1e-5f;
    const Vec3 across = direction - n * dot(n, direction);
    const Mask left = dot(across, across) > kRounding * kRounding * dot(direction, direction);
    return select(left, normalized_or(across, a), a);
}

}  // namespace edgegrad::EDGEGRAD_ISA
