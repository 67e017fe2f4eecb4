// Normal maps, and the tangents that they and anisotropy are relative to (Cycles' svm_node_normal_map and
// primitive_tangent).
#pragma once

#include "scene/geometry.h"
#include "texture/image.h"
#include "texture/point.h"

namespace edgegrad::EDGEGRAD_ISA {

// Tangent of a UV map along u, not normalised, in the mesh's own space; `sign` is that of the bitangent.
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

// M^T v for the linear part M of lanes' instance transforms: a normal in the mesh's space, up to its length.
EG_INLINE Vec3 normal_to_mesh(const SceneView& scene, Int instance, Vec3 v) {
    Vec3 r = v;
    if (!any(instance >= 0)) return r;
    for (int i = 0; i < W; ++i) {
        if (instance[i] < 0) continue;
        const float* m = scene.instance_to_world + 12 * static_cast<int64_t>(instance[i]);
        r.x[i] = m[0] * v.x[i] + m[4] * v.y[i] + m[8] * v.z[i];
        r.y[i] = m[1] * v.x[i] + m[5] * v.y[i] + m[9] * v.z[i];
        r.z[i] = m[2] * v.x[i] + m[6] * v.y[i] + m[10] * v.z[i];
    }
    return r;
}

// M^-T v, up to a positive factor: a normal of the mesh in the world. The columns of M^-T det M are the cross
// products of M's rows.
EG_INLINE Vec3 normal_to_world(const SceneView& scene, Int instance, Vec3 v) {
    Vec3 r = v;
    if (!any(instance >= 0)) return r;
    for (int i = 0; i < W; ++i) {
        if (instance[i] < 0) continue;
        const float* m = scene.instance_to_world + 12 * static_cast<int64_t>(instance[i]);
        const float x = v.x[i], y = v.y[i], z = v.z[i];
        const float a[3] = {m[5] * m[10] - m[6] * m[9], m[6] * m[8] - m[4] * m[10],
                            m[4] * m[9] - m[5] * m[8]};
        const float b[3] = {m[9] * m[2] - m[10] * m[1], m[10] * m[0] - m[8] * m[2],
                            m[8] * m[1] - m[9] * m[0]};
        const float c[3] = {m[1] * m[6] - m[2] * m[5], m[2] * m[4] - m[0] * m[6], m[0] * m[5] - m[1] * m[4]};
        const float turn = m[0] * a[0] + m[1] * a[1] + m[2] * a[2] < 0.0f ? -1.0f : 1.0f;
        r.x[i] = turn * (a[0] * x + a[1] * y + a[2] * z);
        r.y[i] = turn * (b[0] * x + b[1] * y + b[2] * z);
        r.z[i] = turn * (c[0] * x + c[1] * y + c[2] * z);
    }
    return r;
}

// Length of the interpolated corner normals, which tangent space keeps; 1 where the surface is flat.
EG_INLINE Float interpolated_length(const SceneView& scene, Mask active, const TexturePoint& point) {
    Float length2 = splat(1.0f);
    if (!scene.corner_normal) return length2;
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const int32_t* corner = scene.corner_normal + 3 * static_cast<int64_t>(point.face[i]);
        if (corner[0] < 0 || corner[1] < 0 || corner[2] < 0) continue;
        const float b1 = point.b1[i], b2 = point.b2[i], b0 = 1.0f - b1 - b2;
        const float* a = scene.normals + 3 * static_cast<int64_t>(corner[0]);
        const float* b = scene.normals + 3 * static_cast<int64_t>(corner[1]);
        const float* c = scene.normals + 3 * static_cast<int64_t>(corner[2]);
        float sum = 0.0f;
        for (int k = 0; k < 3; ++k) {
            const float n = b0 * a[k] + b1 * b[k] + b2 * c[k];
            sum += n * n;
        }
        if (sum > 0.0f) length2[i] = sum;
    }
    return sqrt(length2);
}

// Lanes' leaves may have different UV maps; -1: none. The mesh's tangents are used where it has them
// ("NAME.tangent"), else the triangle's own along u, made perpendicular to the normal n (in the mesh's
// space).
EG_INLINE UvTangent uv_tangent(const SceneView& scene, Mask active, Int leaf, const TexturePoint& point,
                               Vec3 n) {
    const TextureView& textures = scene.textures;
    UvTangent r{splat(0), zero3(), splat(1.0f)};
    const Int face = select(active, point.face, splat(0));
    for (int i = 0; i < W; ++i) {
        if (!active[i] || !textures.leaf_uv || textures.leaf_uv[leaf[i]] < 0) continue;
        const int32_t mesh = textures.face_mesh[face[i]];
        const auto attribute = [&](int32_t number) -> const TextureAttribute& {
            return textures.mesh_attributes[number * textures.mesh_count + mesh];
        };
        const float b1 = point.b1[i], b2 = point.b2[i];
        const TextureAttribute& made = attribute(textures.leaf_tangent[leaf[i]]);
        const TextureAttribute& uv = attribute(textures.leaf_uv[leaf[i]]);
        if (made.components == 4) {
            const float* p = textures.attributes + made.offset + static_cast<int64_t>(face[i]) * 12;
            const Texel t =
                load_texel(p) * (1.0f - b1 - b2) + load_texel(p + 4) * b1 + load_texel(p + 8) * b2;
            r.tangent.x[i] = t[0], r.tangent.y[i] = t[1], r.tangent.z[i] = t[2];
            r.sign[i] = t[3] < 0.0f ? -1.0f : 1.0f;
            r.known[i] = -1;
        } else if (uv.components >= 2) {
            const int n_uv = uv.components;
            const float* p = textures.attributes + uv.offset + static_cast<int64_t>(face[i]) * 3 * n_uv;
            const float u1 = p[n_uv] - p[0], v1 = p[n_uv + 1] - p[1];
            const float u2 = p[2 * n_uv] - p[0], v2 = p[2 * n_uv + 1] - p[1];
            const float det = u1 * v2 - u2 * v1;
            if (det == 0.0f) continue;
            const float turn = det < 0.0f ? -1.0f : 1.0f;
            const int32_t* f = scene.faces + 3 * static_cast<int64_t>(face[i]);
            const float *p0 = scene.vertices + 3 * static_cast<int64_t>(f[0]),
                        *p1 = scene.vertices + 3 * static_cast<int64_t>(f[1]),
                        *p2 = scene.vertices + 3 * static_cast<int64_t>(f[2]);
            float along[3];
            for (int k = 0; k < 3; ++k) along[k] = turn * ((p1[k] - p0[k]) * v2 - (p2[k] - p0[k]) * v1);
            r.tangent.x[i] = along[0], r.tangent.y[i] = along[1], r.tangent.z[i] = along[2];
            r.sign[i] = turn;
            r.known[i] = -2;
        }
    }
    const Mask own = r.known == -2;
    if (any(own)) {
        const Vec3 flat = r.tangent - n * (dot(n, r.tangent) / max(dot(n, n), 1e-30f));
        r.tangent = select(own, normalized_or(flat, zero3()), r.tangent);
        r.known = r.known != 0;
    }
    return r;
}

// The normal that a leaf's normal map (its colour, in [0, 1]) bends the smooth one to, unit, on the viewer's
// side of the surface; `point.normal` where the mesh has no UV map for it.
EG_INLINE Vec3 shading_normal(const SceneView& scene, Mask active, Int leaf, const TexturePoint& point,
                              Vec3 color, Float strength) {
    if (!any(active)) return point.normal;
    const Vec3 front = select(point.backside, -point.normal, point.normal);
    const Float length = interpolated_length(scene, active, point);
    const Vec3 n = normalized_or(normal_to_mesh(scene, point.instance, front), front) * length;
    const UvTangent t = uv_tangent(scene, active, leaf, point, n);
    const Vec3 bitangent = cross(n, t.tangent) * t.sign;
    const Float x = (2.0f * color.x - 1.0f) * strength, y = (2.0f * color.y - 1.0f) * strength;
    const Float share = min(max(strength, 0.0f), splat(1.0f));
    const Float z = 1.0f + share * ((2.0f * color.z - 1.0f) - 1.0f);
    const Vec3 bent = t.tangent * x + bitangent * y + n * z;
    Vec3 r = normalized_or(normal_to_world(scene, point.instance, bent), front);
    r = select(point.backside, -r, r);
    return select(active & t.known, r, point.normal);
}

// What a bent normal takes from light along wi, relative to the smooth normal: light through the back of the
// smooth surface, and for diffuse closures a soft terminator (Conty Estevez, Lecocq and Stein 2019, "A
// Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem").
EG_INLINE Float bump_shadowing(Vec3 smooth, Vec3 bent, Vec3 wi, Mask diffuse) {
    const Float cos_i = dot(smooth, wi), cos_d = dot(smooth, bent), cos_bent = dot(bent, wi);
    const Mask same = (smooth.x == bent.x) & (smooth.y == bent.y) & (smooth.z == bent.z);
    const Mask leaks = cos_i * cos_d * cos_bent < 0.0f;
    const Float i2 = min(cos_i * cos_i, splat(1.0f)), d2 = min(cos_d * cos_d, splat(1.0f));
    const Float alpha2 = min(0.125f * (1.0f / max(d2, 1e-12f) - 1.0f), splat(1.0f));
    // Smith's G1 of GGX.
    const Float g = 2.0f / (1.0f + sqrt(1.0f + alpha2 * (1.0f / max(i2, 1e-12f) - 1.0f)));
    Float r = select(diffuse & (d2 < 1.0f), select(i2 < 1e-12f, splat(0.0f), g), 1.0f);
    r = select(leaks, splat(0.0f), r);
    return select(same, splat(1.0f), r);
}

// Unit direction of anisotropy, perpendicular to the normal n: along u of the leaf's UV map; without one,
// around the z axis of the mesh's bounding box, as Cycles has it from generated coordinates.
EG_INLINE Vec3 surface_tangent(const SceneView& scene, Mask active, Int leaf, const TexturePoint& point,
                               Vec3 n) {
    const Vec3 front = select(point.backside, -n, n);
    const Vec3 in_mesh = normal_to_mesh(scene, point.instance, front);
    const UvTangent t = uv_tangent(scene, active, leaf, point, in_mesh);
    Vec3 direction = t.tangent;
    const Mask radial = active & ~t.known;
    if (any(radial) && scene.textures.mesh_box && scene.textures.mesh_count > 0) {
        const Triangle triangle = gather_triangle(scene, select(active, point.face, splat(0)));
        const Vec3 p = interpolate(triangle, point.b1, point.b2);
        for (int i = 0; i < W; ++i) {
            if (!radial[i]) continue;
            const float* box = scene.textures.mesh_box + 6 * scene.textures.face_mesh[point.face[i]];
            direction.x[i] = -(p.y[i] - box[1]) / box[4];
            direction.y[i] = (p.x[i] - box[0]) / box[3];
            direction.z[i] = 0.0f;
        }
    }
    direction = normal_to_world(scene, point.instance, direction);
    Vec3 a, b;
    basis(n, a, b);
    return normalized_or(direction - n * dot(n, direction), a);
}

}  // namespace edgegrad::EDGEGRAD_ISA
