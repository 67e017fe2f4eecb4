// Triangles, points on them and rays that leave them.
#pragma once

#include "scene/view.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Triangle {
    Vec3 p0, p1, p2;
};

EG_INLINE Triangle gather_triangle(const SceneView& scene, Int face) {
    Triangle t;
    for (int i = 0; i < W; ++i) {
        const int32_t* f = scene.faces + 3 * static_cast<int64_t>(face[i]);
        const float* a = scene.vertices + 3 * static_cast<int64_t>(f[0]);
        const float* b = scene.vertices + 3 * static_cast<int64_t>(f[1]);
        const float* c = scene.vertices + 3 * static_cast<int64_t>(f[2]);
        t.p0.x[i] = a[0], t.p0.y[i] = a[1], t.p0.z[i] = a[2];
        t.p1.x[i] = b[0], t.p1.y[i] = b[1], t.p1.z[i] = b[2];
        t.p2.x[i] = c[0], t.p2.y[i] = c[1], t.p2.z[i] = c[2];
    }
    return t;
}

// The corners of faces in the world, where `instance` places them (-1: they stand in it themselves). Returns
// -1 where that mirrors them, and so turns their winding, else 1.
EG_INLINE Float place_triangle(const SceneView& scene, Int instance, Triangle& t) {
    Float handed = splat(1.0f);
    if (!any(instance >= 0)) return handed;
    for (int i = 0; i < W; ++i) {
        if (instance[i] < 0) continue;
        const float* m = scene.instance_to_world + 12 * static_cast<int64_t>(instance[i]);
        Vec3* const corners[3] = {&t.p0, &t.p1, &t.p2};
        for (Vec3* p : corners) {
            const float x = p->x[i], y = p->y[i], z = p->z[i];
            p->x[i] = m[0] * x + m[1] * y + m[2] * z + m[3];
            p->y[i] = m[4] * x + m[5] * y + m[6] * z + m[7];
            p->z[i] = m[8] * x + m[9] * y + m[10] * z + m[11];
        }
        const float det = m[0] * (m[5] * m[10] - m[6] * m[9]) + m[1] * (m[6] * m[8] - m[4] * m[10]) +
                          m[2] * (m[4] * m[9] - m[5] * m[8]);
        handed[i] = det < 0.0f ? -1.0f : 1.0f;
    }
    return handed;
}

// M = (p1 - p0) x (p2 - p0): twice the area times the normal.
EG_INLINE Vec3 area_normal(const Triangle& t) { return cross(t.p1 - t.p0, t.p2 - t.p0); }

EG_INLINE Vec3 interpolate(const Triangle& t, Float b1, Float b2) {
    return t.p0 + (t.p1 - t.p0) * b1 + (t.p2 - t.p0) * b2;
}

// Distance that rays keep from a triangle at their ends: interpolated positions are off by a few
// roundings of its largest coordinate.
EG_INLINE Float ray_offset(const Triangle& t) {
    return 2e-6f * max(max(largest_component(t.p0), largest_component(t.p1)), largest_component(t.p2));
}

// Faces that a ray passes through, where `edge` is not negative: those of the edge, and one more.
struct Ignored {
    Int edge;
    Int face;  // or -1
};

EG_INLINE Ignored ignore_nothing() { return {splat(-1), splat(-1)}; }

// A point of a surface, its normal turned to the viewer.
struct SurfacePoint {
    Mask active;
    Int face;
    Float b1, b2;  // barycentrics of p1, p2
    Vec3 position;
    Vec3 normal;     // unit, on the viewer's side
    Float side;      // +1: the viewer is in front (counter-clockwise side), -1: behind
    Float length_m;  // |M|
    Triangle triangle;
    Float offset;  // distance that rays start off the surface
    Int material;
    Int mesh, instance;  // where a ray met the surface; instance -1: none
    // Of a point on an edge (boundary/edge_point.h):
    Ignored ignored;  // faces that it lies on: the edge's, and one in which the edge lies (contact)
    Vec3 along;       // in the point's own surface, across the edge and away from it
};

// The surface point of a face at barycentrics (b1, b2) seen along `view` (towards the surface).
EG_INLINE SurfacePoint surface_point(const SceneView& scene, Mask active, Int face, Float b1, Float b2,
                                     Vec3 view, Int instance = splat(-1)) {
    SurfacePoint s;
    s.face = select(active, face, splat(0));
    s.b1 = b1;
    s.b2 = b2;
    s.triangle = gather_triangle(scene, s.face);
    s.mesh = splat(0);
    s.instance = instance;
    const Float handed = place_triangle(scene, instance, s.triangle);
    s.position = interpolate(s.triangle, b1, b2);
    const Vec3 m = area_normal(s.triangle);
    s.length_m = sqrt(dot(m, m));
    s.active = active & (s.length_m > 0.0f);
    const Float side = select(dot(m, view) < 0.0f, splat(1.0f), -1.0f);
    s.side = side * handed;
    s.normal = m * (side / select(s.length_m > 0.0f, s.length_m, 1.0f));
    s.offset = ray_offset(s.triangle);
    s.ignored = ignore_nothing();
    s.along = zero3();
    s.material = gather(scene.face_material, s.face);
    return s;
}

// Smooth normal at a surface point, unit, on the viewer's side of the triangle; the triangle's own where the
// surface is flat. An instance's normals go by the inverse transpose of its transform, whose columns are the
// cross products of the transform's rows, up to a factor.
EG_INLINE Vec3 smooth_normal(const SceneView& scene, const SurfacePoint& s) {
    if (!scene.corner_normal) return s.normal;
    Vec3 n = zero3();
    Mask smooth = splat(0);
    const Float b0 = 1.0f - s.b1 - s.b2;
    for (int i = 0; i < W; ++i) {
        const int32_t* corner = scene.corner_normal + 3 * static_cast<int64_t>(s.face[i]);
        if (!s.active[i] || corner[0] < 0 || corner[1] < 0 || corner[2] < 0) continue;
        smooth[i] = -1;
        const float* a = scene.normals + 3 * static_cast<int64_t>(corner[0]);
        const float* b = scene.normals + 3 * static_cast<int64_t>(corner[1]);
        const float* c = scene.normals + 3 * static_cast<int64_t>(corner[2]);
        n.x[i] = b0[i] * a[0] + s.b1[i] * b[0] + s.b2[i] * c[0];
        n.y[i] = b0[i] * a[1] + s.b1[i] * b[1] + s.b2[i] * c[1];
        n.z[i] = b0[i] * a[2] + s.b1[i] * b[2] + s.b2[i] * c[2];
        if (s.instance[i] < 0) continue;
        const float* m = scene.instance_to_world + 12 * static_cast<int64_t>(s.instance[i]);
        const float x = n.x[i], y = n.y[i], z = n.z[i];
        const float c0[3] = {m[5] * m[10] - m[6] * m[9], m[6] * m[8] - m[4] * m[10],
                             m[4] * m[9] - m[5] * m[8]};
        const float c1[3] = {m[9] * m[2] - m[10] * m[1], m[10] * m[0] - m[8] * m[2],
                             m[8] * m[1] - m[9] * m[0]};
        const float c2[3] = {m[1] * m[6] - m[2] * m[5], m[2] * m[4] - m[0] * m[6], m[0] * m[5] - m[1] * m[4]};
        const float det = m[0] * c0[0] + m[1] * c0[1] + m[2] * c0[2];
        const float turn = det < 0.0f ? -1.0f : 1.0f;
        n.x[i] = turn * (c0[0] * x + c0[1] * y + c0[2] * z);
        n.y[i] = turn * (c1[0] * x + c1[1] * y + c1[2] * z);
        n.z[i] = turn * (c2[0] * x + c2[1] * y + c2[2] * z);
    }
    const Float length2 = dot(n, n);
    smooth &= length2 > 0.0f;
    const Float turned = s.side * (1.0f / sqrt(select(smooth, length2, 1.0f)));
    return select(smooth, n * turned, s.normal);
}

}  // namespace edgegrad::EDGEGRAD_ISA
