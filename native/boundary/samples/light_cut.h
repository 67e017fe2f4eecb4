// Points of the intersection lines of faces with lights of the light table
// (boundary/curves/light_intersections.h).
//
// Rectangles and ellipses are intersected along straight lines. For a sphere, the stored line is the chord of
// an arc, the intersection with the face's plane. With v the vector from the arc's centre to the chord's
// point at u, t the chord and r the arc's radius
//   q = centre + r v/|v|,    dq/du = r/|v| (t - v (v . t)/v^2).
// A disk faces the point x that it lights, so its line can be computed only once x is known.
#pragma once

#include "shading/lights/light_rows.h"

namespace edgegrad::EDGEGRAD_ISA {

// The face, its instance, and the light's row of each line.
EG_INLINE void faces_of_line(const SceneView& scene, Mask active, Int line, Int& face, Int& instance,
                             Int& row) {
    face = row = splat(0);
    instance = splat(-1);
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        instance[i] = face_instance(scene, line[i], -1, 0);
        face[i] = scene.surface_of_line(line[i], 0).face();
        row[i] = scene.surface_of_line(line[i], 1).light_row();
    }
}

struct LightCut {
    Mask active;
    Vec3 point, tangent;  // q, dq/du
    Vec3 normal;          // of the light at q, unit
};

// The intersection at `point` of the line `tangent` through a light that is no disk. face_normal is unit.
EG_INLINE LightCut light_cut(const LightRow& l, Int kind, Vec3 point, Vec3 tangent, Vec3 face_normal) {
    LightCut cut{splat(-1), point, tangent, l.direction};
    const Mask sphere = kind == splat(kSphereLight);
    if (!any(sphere)) return cut;
    const Float height = dot(face_normal, point - l.position);
    const Vec3 middle = l.position + face_normal * height, way = point - middle;
    const Float inverse = 1.0f / max(sqrt(dot(way, way)), 1e-30f);
    const Vec3 out = way * inverse;
    const Float ring = sqrt(max(l.radius * l.radius - height * height, 0.0f));
    cut.point = select(sphere, middle + out * ring, point);
    cut.tangent = select(sphere, (tangent - out * dot(out, tangent)) * (ring * inverse), tangent);
    const Vec3 normal = (cut.point - l.position) * (1.0f / max(l.radius, 1e-30f));
    cut.normal = select(sphere, normal, cut.normal);
    return cut;
}

// The point at u, from 0 to 1, of the line along which a triangle intersects the disk that faces x.
EG_INLINE LightCut facing_disk_cut(const LightRow& l, const Triangle& t, Vec3 face_normal, Vec3 x, Float u) {
    constexpr float kParallel = 1e-6f;  // as in boundary/meshes/face_cut.h
    // Find the line of the two planes
    const Vec3 axis = unit_vector(x - l.position);
    const Vec3 along = cross(face_normal, axis);
    const Float sine2 = dot(along, along);
    LightCut cut{sine2 > kParallel, l.position, zero3(), axis};
    const Vec3 e = along * (1.0f / sqrt(max(sine2, kParallel))), across = cross(axis, e);
    // Clip the line foot + e s to the disk and to the triangle.
    const Float lean = dot(face_normal, across);
    const Float off = dot(face_normal, t.p0 - l.position) / select(cut.active, lean, 1.0f);
    const Vec3 foot = l.position + across * off;
    const Float half2 = l.radius * l.radius - off * off;
    cut.active &= half2 > 0.0f;
    Float high = sqrt(max(half2, 0.0f)), low = -high;
    const Vec3 corner[3] = {t.p0, t.p1, t.p2};
    for (int k = 0; k < 3; ++k) {
        const Vec3 inwards = cross(face_normal, corner[(k + 1) % 3] - corner[k]);
        const Float inside = dot(inwards, foot - corner[k]), rate = dot(inwards, e);
        const Float at = -inside / select(rate != 0.0f, rate, 1.0f);
        low = select(rate > 0.0f, max(low, at), low);
        high = select(rate < 0.0f, min(high, at), high);
        cut.active &= (rate != 0.0f) | (inside > 0.0f);
    }
    cut.active &= high > low;
    cut.point = foot + e * (low + (high - low) * u);
    cut.tangent = e * (high - low);
    return cut;
}

}  // namespace edgegrad::EDGEGRAD_ISA
