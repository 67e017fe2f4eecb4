// Directions for which an edge is a silhouette: all of its faces lie on one side of the plane through edge
// and direction.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "sampling/hemisphere.h"
#include "tasks/boundary_task.h"
#include "tasks/edge_weight_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The corner off the edge of face number k, relative to the edge's first end, as placed by the edge's
// instance.
EG_INLINE void across_edge(const SceneView& scene, const SegmentSample& p, int lane, uint32_t k,
                           float (&out)[3]) {
    const float* c = scene.vertices + 3 * static_cast<int64_t>(scene.edge_opposite[k]);
    out[0] = c[0], out[1] = c[1], out[2] = c[2];
    place_point(scene, p.instance[lane], out);
    out[0] -= p.a.x[lane], out[1] -= p.a.y[lane], out[2] -= p.a.z[lane];
}

// Unit vectors across the edge: b1 into its first face, and b2 perpendicular to b1, on the second face's
// side. Sets delta to the angle between the two faces (0 unless there are exactly two).
EG_INLINE void edge_frame(const SceneView& scene, const SegmentSample& p, Vec3& axis, Vec3& b1, Vec3& b2,
                          Float& delta) {
    axis = unit_vector(p.t);
    Vec3 third[2] = {zero3(), zero3()};
    Mask two = splat(0);
    for (int i = 0; i < W; ++i) {
        const uint32_t first = scene.edge_face_first[p.edge[i]], last = scene.edge_face_first[p.edge[i] + 1];
        two[i] = last - first == 2 ? -1 : 0;
        for (uint32_t k = 0; k < 2 && first + k < last; ++k) {
            float c[3];
            across_edge(scene, p, i, first + k, c);
            third[k].x[i] = c[0], third[k].y[i] = c[1], third[k].z[i] = c[2];
        }
    }
    Vec3 across[2];
    for (int k = 0; k < 2; ++k) across[k] = unit_vector(third[k] - axis * dot(third[k], axis));
    b1 = across[0];
    b2 = cross(axis, b1);
    const Float c = dot(b1, across[1]), s = dot(b2, across[1]);
    b2 = select(two & (s < 0.0f), -b2, b2);
    // atan2 is accurate for small angles and for nearly flat pairs alike.
    for (int i = 0; i < W; ++i) delta[i] = two[i] ? __builtin_atan2f(__builtin_fabsf(s[i]), c[i]) : 0.0f;
}

// sigma: +1 or -1 if all faces of the edge lie on that side of the plane with normal `across`, else 0.
EG_INLINE Float occluder_side(const SceneView& scene, const SegmentSample& p, Vec3 across) {
    Float sigma = splat(0.0f);
    for (int i = 0; i < W; ++i) {
        if (!p.active[i]) continue;
        int plus = 0, minus = 0;
        for (uint32_t k = scene.edge_face_first[p.edge[i]]; k < scene.edge_face_first[p.edge[i] + 1]; ++k) {
            float c[3];
            across_edge(scene, p, i, k, c);
            const float h = across.x[i] * c[0] + across.y[i] * c[1] + across.z[i] * c[2];
            plus += h > 0.0f;
            minus += h < 0.0f;
        }
        sigma[i] = plus && !minus ? 1.0f : minus && !plus ? -1.0f : 0.0f;
    }
    return sigma;
}

// A direction about the edge. u gives its cosine to the edge, and v its azimuth in the two wedges of angle
// alpha in which both faces are on one side (derivations, E). `density` is per solid angle in the wedges,
// 1/(4 alpha). In lanes of `parted`, half of the directions have a uniform azimuth, or all if the wedges are
// narrow (density_about).
EG_INLINE Vec3 wedge_direction(const SceneView& scene, const SegmentSample& p, Mask parted, Float u, Float v,
                               Float& density) {
    Vec3 axis, b1, b2;
    Float delta = splat(0.0f);
    edge_frame(scene, p, axis, b1, b2, delta);
    constexpr float kPi = 3.14159265f;
    const Float wedge = splat(kPi) - delta;
    density = 1.0f / (4.0f * max(wedge, 1e-12f));
    const Mask wide = wedge > kLeastWedge, around = parted & (~wide | (v >= 0.5f));
    v = select(parted & wide, 2.0f * v - select(around, splat(1.0f), splat(0.0f)), v);
    delta = select(around, splat(0.0f), delta);
    const Float alpha = splat(kPi) - delta;
    const Float cosine = 2.0f * u - 1.0f, sine = sqrt(max(1.0f - cosine * cosine, 0.0f));
    const Mask second = v >= 0.5f;
    const Float within = select(second, 2.0f * v - 1.0f, 2.0f * v);
    Float azimuth = (delta + within * alpha + select(second, splat(kPi), 0.0f)) * (0.5f / kPi);
    azimuth = select(azimuth >= 1.0f, azimuth - 1.0f, azimuth);
    Float s, c;
    sincos_turn(max(azimuth, 0.0f), s, c);
    return axis * cosine + (b1 * c + b2 * s) * sine;
}

// A sample's random numbers, mapped into its direction cell. Returns the number of cells.
EG_INLINE float cell_numbers(const BoundaryTask& task, const SegmentSample& p, Float& u, Float& v) {
    sobol_pair(p.random.stream, p.random.sample, kPairEnvironment, u, v);
    const float width = 1.0f / static_cast<float>(task.direction_cells);
    const Int row = quotient(p.cell, task.direction_cells), column = p.cell - row * task.direction_cells;
    u = (to_float(column) + u) * width, v = (to_float(row) + v) * width;
    return 1.0f / (width * width);
}

// A direction for these numbers. `density` is per solid angle in the wedges.
EG_INLINE Vec3 cell_direction(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                              Mask parted, Float& density) {
    Float u, v;
    const float cells = cell_numbers(task, p, u, v);
    const Vec3 w = wedge_direction(scene, p, parted, u, v, density);
    density = density * cells;
    return w;
}

// The density of cell_direction at any w, given that of the wedges.
EG_INLINE Float density_about(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                              Mask parted, Vec3 w, Float density) {
    if (!any(parted)) return density;
    const float cells = static_cast<float>(task.direction_cells) * static_cast<float>(task.direction_cells);
    const float even = cells * (0.25f * kInvPi);
    const Mask wide = density < splat(cells * (0.25f / kLeastWedge));
    const Mask within = occluder_side(scene, p, cross(p.t, w)) != 0.0f;
    const Float both = select(wide, 0.5f * (select(within, density, splat(0.0f)) + even), splat(even));
    return select(parted, both, density);
}

}  // namespace edgegrad::EDGEGRAD_ISA
