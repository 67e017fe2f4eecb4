// Samples of outlines of distance fields, as a viewer sees them.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "sdf/outline_point.h"
#include "sdf/place_code.h"

namespace edgegrad::EDGEGRAD_ISA {

// The face that stands for the field of each line.
EG_INLINE Int field_of_line(const SceneView& scene, Mask active, Int line) {
    Int face = splat(0);
    for (int i = 0; i < W; ++i)
        if (active[i]) face[i] = scene.surface_of_line(line[i], 0).face();
    return face;
}

// A tangent direction, turned a little against the normal, so that rounding does not decide whether a ray
// meets the front of the surface. With `out` it is turned the other way.
EG_INLINE Vec3 onto_surface(Vec3 direction, Vec3 normal, bool out = false) {
    constexpr float kTurn = 1e-4f;
    const Vec3 turned = direction - normal * splat(out ? -kTurn : kTurn);
    return turned * (1.0f / sqrt(dot(turned, turned)));
}

EG_INLINE void set_lane3(Vec3& out, int lane, const float (&p)[3]) {
    out.x[lane] = p[0], out.y[lane] = p[1], out.z[lane] = p[2];
}
// Sets a lane's barycentrics to a place of a field, as hits have it (sdf/place_code.h).
EG_INLINE void set_place(const FieldView& field, const double (&grid)[3], int lane, Float& b1, Float& b2) {
    uint32_t code[2];
    encode_place(field, grid, code);
    float place[2];
    __builtin_memcpy(place, code, sizeof place);
    b1[lane] = place[0], b2[lane] = place[1];
}

// The same for the lanes of a mask, at points of the world.
EG_INLINE void set_places(const SceneView& scene, Mask lanes, Int face, Vec3 at, Float& b1, Float& b2) {
    for (int i = 0; i < W; ++i) {
        if (!lanes[i]) continue;
        const FieldView& field = field_of_face(scene, face[i]);
        const float point[3] = {at.x[i], at.y[i], at.z[i]};
        double grid[3];
        field.place_in_grid(point, grid);
        set_place(field, grid, i, b1, b2);
    }
}

// Calls back with each sample's point of the outline on its segment, seen from viewer(lane, field). Samples
// without a point become inactive.
template <typename Viewer, typename Visit>
EG_INLINE void for_each_outline_point(const SceneView& scene, Mask& active, Int line, Float u,
                                      const Viewer& viewer, const Visit& visit) {
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const FieldView& field = field_of_face(scene, scene.surface_of_line(line[i], 0).face());
        float a[3], b[3];
        edge_end(scene, line[i], -1, 0, a);
        edge_end(scene, line[i], -1, 1, b);
        OutlinePoint p;
        if (outline_point(field, viewer(i, field), a, b, u[i], p))
            visit(i, field, p);
        else
            active[i] = 0;
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
