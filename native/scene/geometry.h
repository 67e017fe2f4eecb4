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
    // Of a point on an edge (boundary/edge_point.h):
    Ignored ignored;  // faces that it lies on: the edge's, and one in which the edge lies (contact)
    Vec3 along;       // in the point's own surface, across the edge and away from it
};

// The surface point of a face at barycentrics (b1, b2) seen along `view` (towards the surface).
EG_INLINE SurfacePoint surface_point(const SceneView& scene, Mask active, Int face, Float b1, Float b2,
                                     Vec3 view) {
    SurfacePoint s;
    s.face = select(active, face, splat(0));
    s.b1 = b1;
    s.b2 = b2;
    s.triangle = gather_triangle(scene, s.face);
    s.position = interpolate(s.triangle, b1, b2);
    const Vec3 m = area_normal(s.triangle);
    s.length_m = sqrt(dot(m, m));
    s.active = active & (s.length_m > 0.0f);
    s.side = select(dot(m, view) < 0.0f, splat(1.0f), -1.0f);
    s.normal = m * (s.side / select(s.length_m > 0.0f, s.length_m, 1.0f));
    s.offset = ray_offset(s.triangle);
    s.ignored = ignore_nothing();
    s.along = zero3();
    s.material = gather(scene.face_material, s.face);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
