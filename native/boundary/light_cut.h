// Points of the lines along which faces pass through lights of the light table (boundary/pierced_lights.h).
//
// A rectangle or an ellipse is cut along a straight line. Of a sphere the line is the chord of the arc along
// which the face's plane cuts it: with v the way from the circle's middle to the chord's point at u, t the
// chord and r the circle's radius
//   q = middle + r v/|v|,    dq/du = r/|v| (t - v (v . t)/v^2).
#pragma once

#include "boundary/crossing_point.h"
#include "shading/light_rows.h"

namespace edgegrad::EDGEGRAD_ISA {

// The faces and the lights' rows of lines.
EG_INLINE void faces_of_line(const SceneView& scene, Mask active, Int line, Int& face, Int& row) {
    face = row = splat(0);
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const uint32_t* faces = scene.edge_faces + scene.edge_face_first[line[i]];
        face[i] = static_cast<int32_t>(faces[0]);
        row[i] = static_cast<int32_t>(faces[1] & ~kLightOfTable);
    }
}

struct LightCut {
    Vec3 point, tangent;  // q, dq/du
    Vec3 normal;          // unit, the light's at q
};

// At `point` of the line `tangent`, on a face with this unit normal.
EG_INLINE LightCut light_cut(const LightRow& l, Int kind, Vec3 point, Vec3 tangent, Vec3 face_normal) {
    LightCut cut{point, tangent, l.direction};
    const Mask sphere = kind == splat(static_cast<int>(kSphereLight));
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

}  // namespace edgegrad::EDGEGRAD_ISA
