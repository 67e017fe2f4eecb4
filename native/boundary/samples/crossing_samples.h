// Samples of the curves along which distance fields pass through meshes and through each other
// (boundary/fields/field_crossings.h).
#pragma once

#include "boundary/samples/intersection_point.h"
#include "boundary/samples/outline_samples.h"
#include "boundary/samples/visible_edge.h"
#include "sdf/crossing_point.h"

namespace edgegrad::EDGEGRAD_ISA {

// One of the two surfaces of a curve, at a point of it: a face and barycentrics as those of a hit.
struct CrossedSide {
    Int face, instance;
    Mask field;
    Vec3 normal;  // unit; that of a field points outwards
    Float b1, b2;
};

struct CrossingSample {
    Vec3 position, tangent;
    Mask reversed;
    CrossedSide side[2];
};

EG_INLINE Vector vector_of(const Vec3& v, int lane) {
    return {static_cast<double>(v.x[lane]), static_cast<double>(v.y[lane]), static_cast<double>(v.z[lane])};
}
EG_INLINE void set_lane3(Vec3& out, int lane, const Vector& v) {
    out.x[lane] = static_cast<float>(v.x), out.y[lane] = static_cast<float>(v.y);
    out.z[lane] = static_cast<float>(v.z);
}

// The surface k of a lane's curve.
EG_INLINE CrossedSurface crossed_surface(const SceneView& scene, const CrossedSide& side, const Triangle& t,
                                         int lane) {
    if (side.field[lane]) return crossed_field(field_of_face(scene, side.face[lane]));
    const Vector p0 = vector_of(t.p0, lane),
                 m = cross(vector_of(t.p1, lane) - p0, vector_of(t.p2, lane) - p0);
    return {nullptr, p0, m * (1.0 / length(m))};
}

// Moves samples from their segments to the curve. Samples without a point become inactive.
EG_OUTLINE void place_on_crossings(const SceneView& scene, Mask& active, Int line, Float u,
                                   CrossingSample& out) {
    Triangle triangle[2];
    for (int k = 0; k < 2; ++k) {
        CrossedSide& side = out.side[k];
        side.face = splat(0);
        side.instance = splat(-1);
        for (int i = 0; i < W; ++i) {
            if (!active[i]) continue;
            side.face[i] = scene.surface_of_line(line[i], static_cast<uint32_t>(k)).face();
            side.instance[i] = face_instance(scene, line[i], -1, static_cast<uint32_t>(k));
        }
        side.field = on_field(scene, active, side.face);
        side.normal = {splat(0.0f), splat(0.0f), splat(1.0f)};
        side.b1 = side.b2 = splat(0.0f);
        triangle[k] = placed_triangle(scene, side.face, side.instance).triangle;
    }
    out.position = out.tangent = zero3();
    out.reversed = splat(0);
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const CrossedSurface surfaces[2] = {crossed_surface(scene, out.side[0], triangle[0], i),
                                            crossed_surface(scene, out.side[1], triangle[1], i)};
        float a[3], b[3];
        edge_end(scene, line[i], -1, 0, a);
        edge_end(scene, line[i], -1, 1, b);
        CrossingPoint p;
        if (!crossing_point(surfaces, a, b, u[i], p)) {
            active[i] = 0;
            continue;
        }
        set_lane3(out.position, i, p.position);
        set_lane3(out.tangent, i, p.tangent);
        out.reversed[i] = p.reversed ? -1 : 0;
        for (int k = 0; k < 2; ++k) {
            CrossedSide& side = out.side[k];
            set_lane3(side.normal, i, p.normal[k]);
            if (!surfaces[k].field) continue;
            const double at[3] = {p.position.x, p.position.y, p.position.z};
            double grid[3];
            surfaces[k].field->place_in_grid(at, grid);
            set_place(*surfaces[k].field, grid, i, side.b1, side.b2);
        }
    }
    for (int k = 0; k < 2; ++k) {
        CrossedSide& side = out.side[k];
        Float b1, b2;
        place_in_face(triangle[k], out.position, b1, b2);
        side.b1 = select(side.field, side.b1, b1);
        side.b2 = select(side.field, side.b2, b2);
    }
}

// Lanes that a ray along `direction` reaches before other parts of their fields near the point. Sets over
// which length that holds, on the side k; 0: no field.
EG_OUTLINE Mask reached_first(const SceneView& scene, Mask active, const CrossingSample& x, Vec3 direction,
                              Float (&contact)[2]) {
    for (int k = 0; k < 2; ++k) {
        contact[k] = splat(0.0f);
        for (int i = 0; i < W; ++i) {
            if (!active[i] || !x.side[k].field[i]) continue;
            float length = 0.0f;
            if (!meets_first(field_of_face(scene, x.side[k].face[i]), vector_of(x.position, i),
                             vector_of(x.side[k].normal, i), vector_of(direction, i), length))
                active[i] = 0;
            contact[k][i] = length;
        }
    }
    return active;
}

// The distance at which rays beside the curve start on one of the two surfaces: it clears the rounding of
// both.
EG_INLINE Float step_length(const SceneView& scene, Mask active, const CrossingSample& x) {
    Float most = splat(0.0f);
    for (const CrossedSide& side : x.side) {
        Triangle t = placed_triangle(scene, side.face, side.instance).triangle;
        Float b1 = side.b1, b2 = side.b2;
        settle_on_fields(scene, active, side.face, t, b1, b2);
        most = max(most, aside(t));
    }
    return most;
}

// The step from the curve, within a surface, towards a direction.
EG_INLINE Vec3 step_beside(const CrossedSide& side, Vec3 tangent, Vec3 towards, Float length) {
    const Vec3 across = unit_vector(cross(side.normal, tangent));
    return select(dot(across, towards) < 0.0f, -across, across) * length;
}

}  // namespace edgegrad::EDGEGRAD_ISA
