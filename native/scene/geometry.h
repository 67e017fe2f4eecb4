// Triangles, points on them, and rays that leave them.
#pragma once

#include "scene/view.h"
#include "sdf/tangent_plane.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Triangle {
    Vec3 p0, p1, p2;
};

// Reads the three entries of each lane's row of an integer table.
EG_INLINE void gather_corners(const int32_t* table, Int row, Rows (&out)[3]) {
    for (int i = 0; i < W; ++i) {
        const int32_t* p = table + 3 * static_cast<int64_t>(row[i]);
        for (int k = 0; k < 3; ++k) out[k][i] = p[k];
    }
}

EG_INLINE Triangle gather_triangle(const SceneView& scene, Int face) {
    Rows corner[3];
    gather_corners(scene.faces, face, corner);
    return {gather3(scene.vertices, corner[0]), gather3(scene.vertices, corner[1]),
            gather3(scene.vertices, corner[2])};
}

// Instance transforms by lane: the rows of the linear part, and the translation.
struct Placement {
    Vec3 x, y, z, origin;
};

// Lanes without an instance (-1) get an arbitrary row.
EG_INLINE Placement gather_placement(const SceneView& scene, Int instance) {
    Float m[12];
    gather_row(scene.instance_to_world, 12, select(instance >= 0, instance, splat(0)), m);
    return {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[3], m[7], m[11]}};
}

// +1, or -1 for mirroring transforms.
EG_INLINE Float handedness(const Placement& p) {
    return select(dot(p.x, cross(p.y, p.z)) < 0.0f, splat(-1.0f), 1.0f);
}

// M^-T v up to a positive factor: a normal in the world. The columns of M^-T det M are the cross products of
// M's rows.
EG_INLINE Vec3 place_normal(const Placement& p, Vec3 v) {
    const Vec3 a = cross(p.y, p.z), b = cross(p.z, p.x), c = cross(p.x, p.y);
    return Vec3{dot(a, v), dot(b, v), dot(c, v)} * select(dot(p.x, a) < 0.0f, splat(-1.0f), 1.0f);
}

// Position of a mesh's point in the world.
EG_INLINE Vec3 place_point(const Placement& m, Vec3 p) {
    return Vec3{dot(m.x, p), dot(m.y, p), dot(m.z, p)} + m.origin;
}

// Transforms the corners of faces to the world by their `instance` (-1: they already are in the world).
// Returns -1 where the transform mirrors them and thus reverses their winding, else 1.
EG_INLINE Float place_triangle(const SceneView& scene, Int instance, Triangle& t) {
    const Mask placed = instance >= 0;
    if (!any(placed)) return splat(1.0f);
    const Placement m = gather_placement(scene, instance);
    Vec3* const corners[3] = {&t.p0, &t.p1, &t.p2};
    for (Vec3* p : corners) *p = select(placed, place_point(m, *p), *p);
    return select(placed, handedness(m), splat(1.0f));
}

// Hits of distance fields, which the face tells.
EG_INLINE bool is_on_field(const SceneView& scene, int32_t face) {
    const int32_t number = face - scene.first_field_face;
    return number >= 0 && number < scene.field_count;
}
EG_INLINE const FieldView& field_of_face(const SceneView& scene, int32_t face) {
    return scene.fields[face - scene.first_field_face];
}
EG_INLINE Mask on_field(const SceneView& scene, Mask active, Int face) {
    if (scene.field_count == 0) return splat(0);
    const Int number = face - scene.first_field_face;
    return active & (number >= 0) & (number < scene.field_count);
}

EG_INLINE Triangle select(Mask m, const Triangle& a, const Triangle& b) {
    return {select(m, a.p0, b.p0), select(m, a.p1, b.p1), select(m, a.p2, b.p2)};
}

EG_INLINE void set_lane(Float& a, int lane, float value) {
#ifdef EDGEGRAD_TAPED
    a.value[lane] = value;
#else
    a[lane] = value;
#endif
}

// Replaces the triangles of hits of fields by triangles in the surface's tangent plane that begin at the hit.
EG_OUTLINE void place_on_fields(const SceneView& scene, Mask lanes, Int face, Triangle& t, Float& b1,
                                Float& b2) {
    const auto bits_of = [](float value) {
        uint32_t bits;
        __builtin_memcpy(&bits, &value, sizeof bits);
        return bits;
    };
    Triangle tangent{zero3(), zero3(), zero3()};
    for (int i = 0; i < W; ++i) {
        if (!lanes[i]) continue;
        const uint32_t code[2] = {bits_of(b1[i]), bits_of(b2[i])};
        float corners[3][3];
        tangent_triangle(field_of_face(scene, face[i]), code, corners);
        Vec3* const out[3] = {&tangent.p0, &tangent.p1, &tangent.p2};
        for (int k = 0; k < 3; ++k) {
            set_lane(out[k]->x, i, corners[k][0]);
            set_lane(out[k]->y, i, corners[k][1]);
            set_lane(out[k]->z, i, corners[k][2]);
        }
    }
    t = select(lanes, tangent, t);
    b1 = select(lanes, splat(0.0f), b1);
    b2 = select(lanes, splat(0.0f), b2);
}
EG_INLINE void settle_on_fields(const SceneView& scene, Mask active, Int face, Triangle& t, Float& b1,
                                Float& b2) {
    const Mask lanes = on_field(scene, active, face);
    if (scene.field_count > 0 && any(lanes)) place_on_fields(scene, lanes, face, t, b1, b2);
}

// M = (p1 - p0) x (p2 - p0): twice the area times the normal.
EG_INLINE Vec3 area_normal(const Triangle& t) { return cross(t.p1 - t.p0, t.p2 - t.p0); }

// Barycentrics of a point in a face's plane.
EG_INLINE void place_in_face(const Triangle& t, Vec3 at, Float& b1, Float& b2) {
    const Vec3 m = area_normal(t), d = at - t.p0;
    const Float size = 1.0f / max(dot(m, m), 1e-37f);
    b1 = dot(m, cross(d, t.p2 - t.p0)) * size;
    b2 = dot(m, cross(t.p1 - t.p0, d)) * size;
}

EG_INLINE Vec3 interpolate(const Triangle& t, Float b1, Float b2) {
    return {interpolate(t.p0.x, t.p1.x, t.p2.x, b1, b2), interpolate(t.p0.y, t.p1.y, t.p2.y, b1, b2),
            interpolate(t.p0.z, t.p1.z, t.p2.z, b1, b2)};
}

// Distance of ray origins from their triangle. The error of interpolated positions is a few roundings of the
// largest coordinate.
EG_INLINE Float ray_offset(const Triangle& t) {
    return 2e-6f * max(max(largest_component(detach(t.p0)), largest_component(detach(t.p1))),
                       largest_component(detach(t.p2)));
}

// Faces that a ray ignores: those of an edge (-1: none).
struct Ignored {
    Int edge;
    Int instance;  // of the edge; -1: the edge is in the world itself
};

EG_INLINE Ignored ignore_nothing() { return {splat(-1), splat(-1)}; }

// The instance of the k-th face of an edge: that of the edge. The two faces of an intersection curve have
// instances of their own.
EG_INLINE int32_t face_instance(const SceneView& scene, int32_t edge, int32_t instance, uint32_t k) {
    if (!scene.is_intersection(edge) || !scene.intersection_instances) return instance;
    return scene.intersection_instances[2 * scene.intersection(edge) + k];
}
// Lanes of lines that are no edges (SceneView).
EG_INLINE Mask is_intersection(const SceneView& scene, Int line) { return line >= scene.edge_count; }
EG_INLINE Int face_instance(const SceneView& scene, Int edge, Mask intersection, Int instance, int k) {
    if (!scene.intersection_instances || !any(intersection)) return instance;
    const Int row = select(intersection, edge - scene.edge_count, splat(0));
    return select(intersection, gather(scene.intersection_instances, 2 * row + k), instance);
}

// A point of a surface. Its normal is on the viewer's side.
struct SurfacePoint {
    Mask active;
    Int face;
    Float b1, b2;  // barycentrics of p1, p2
    Vec3 position;
    Vec3 normal;     // unit, on the viewer's side
    Float side;      // +1: the viewer is in front (counter-clockwise side), -1: behind
    Float length_m;  // |M|
    Triangle triangle;
    Float offset;  // distance of ray origins from the surface
    Int material;
    Int mesh, instance;  // of the hit; instance -1: none
};

// A face in the world, and the handedness of its instance (place_triangle).
struct PlacedTriangle {
    Triangle triangle;
    Float handed;
};
EG_INLINE PlacedTriangle placed_triangle(const SceneView& scene, Int face, Int instance) {
    PlacedTriangle t;
    t.triangle = gather_triangle(scene, face);
    t.handed = place_triangle(scene, instance, t.triangle);
    return t;
}
// Other lanes get an arbitrary face.
EG_INLINE PlacedTriangle placed_triangle(const SceneView& scene, Mask active, Int face, Int instance) {
    return placed_triangle(scene, select(active, face, splat(0)), select(active, instance, splat(-1)));
}

// The surface point of a face at barycentrics (b1, b2), seen along `view` (towards the surface).
EG_INLINE SurfacePoint surface_point(const SceneView& scene, Mask active, Int face, const PlacedTriangle& t,
                                     Float b1, Float b2, Vec3 view, Int instance) {
    SurfacePoint s;
    s.face = face;
    s.triangle = t.triangle;
    settle_on_fields(scene, active, face, s.triangle, b1, b2);
    s.b1 = b1;
    s.b2 = b2;
    s.mesh = splat(0);
    s.instance = instance;
    s.position = interpolate(s.triangle, b1, b2);
    const Vec3 m = area_normal(s.triangle);
    s.length_m = sqrt(dot(m, m));
    s.active = active & (s.length_m > 0.0f);
    const Float side = select(dot(m, view) < 0.0f, splat(1.0f), -1.0f);
    s.side = side * t.handed;
    s.normal = m * (side / select(s.length_m > 0.0f, s.length_m, 1.0f));
    s.offset = ray_offset(s.triangle);
    s.material = gather(scene.face_material, s.face);
    return s;
}
EG_INLINE SurfacePoint surface_point(const SceneView& scene, Mask active, Int face, Float b1, Float b2,
                                     Vec3 view, Int instance = splat(-1)) {
    const Int known = select(active, face, splat(0));
    return surface_point(scene, active, known, placed_triangle(scene, known, instance), b1, b2, view,
                         instance);
}

// The mesh of a face.
EG_INLINE Int mesh_of(const SceneView& scene, Int face) {
    Int low = splat(0), high = splat(scene.mesh_count);
    while (any(high - low > 1)) {
        const Int mid = (low + high) / 2;
        const Mask behind = gather(scene.mesh_first_face, mid) <= face;
        low = select(behind, mid, low);
        high = select(behind, high, mid);
    }
    return low;
}

// The interpolated corner normals of faces. `smooth` becomes the active lanes whose face has all three.
EG_INLINE Vec3 interpolated_normal(const SceneView& scene, Mask active, Int face, Float b1, Float b2,
                                   Mask& smooth) {
    Rows corner[3];
    gather_corners(scene.corner_normal, select(active, face, splat(0)), corner);
    const Int c0 = packet(corner[0]), c1 = packet(corner[1]), c2 = packet(corner[2]);
    smooth = active & ((c0 | c1 | c2) >= 0);
    if (!any(smooth)) return zero3();
    const auto normal = [&](Int c) { return gather3(scene.normals, select(smooth, c, splat(0))); };
    return normal(c0) * (1.0f - b1 - b2) + normal(c1) * b1 + normal(c2) * b2;
}

// The smooth normal at a surface point: unit, on the viewer's side of the triangle. The geometric normal
// where the surface is flat.
EG_INLINE Vec3 smooth_normal(const SceneView& scene, const SurfacePoint& s) {
    if (!scene.corner_normal) return s.normal;
    Mask smooth;
    Vec3 n = interpolated_normal(scene, s.active, s.face, s.b1, s.b2, smooth);
    if (!any(smooth)) return s.normal;
    const Mask placed = s.instance >= 0;
    if (any(placed)) n = select(placed, place_normal(gather_placement(scene, s.instance), n), n);
    const Float length2 = dot(n, n);
    smooth &= length2 > 0.0f;
    const Float turned = s.side * (1.0f / sqrt(select(smooth, length2, 1.0f)));
    return select(smooth, n * turned, s.normal);
}

}  // namespace edgegrad::EDGEGRAD_ISA
