// The curve that the last ray of a chain touches (boundary/specular/scan_lines.h): an edge of a mesh, the
// outline of a distance field as the chain's last vertex sees it, or the line where two surfaces pass through
// each other.
#pragma once

#include <cmath>

#include "boundary/samples/crossing_samples.h"
#include "boundary/specular/chain.h"
#include "boundary/specular/mirrored_outline.h"

namespace edgegrad::EDGEGRAD_ISA {

struct TouchedCurve {
    int32_t edge = -1, instance = -1;
    float u = 0.0f;      // place along the edge
    int32_t field = -1;  // the face that stands for a field; -1: none
    // Of its outline: the unit normal points to the side of the rays that pass (sdf/outline_point.h)
    float point[3] = {}, normal[3] = {}, contact = 0.0f;
    // Two surfaces that pass through each other at the point; -1: none
    struct {
        int32_t face = -1, instance = -1;
    } crossed[2];
    int32_t light = -1;  // the row of a light of the table, whose outline it is; -1: none
    float off = 3e38f;   // angle by which the ray misses the curve

    bool found() const { return edge >= 0 || field >= 0 || crossed[0].face >= 0 || light >= 0; }
};

EG_INLINE void try_edge(const SceneView& scene, int32_t edge, int32_t instance, const float (&from)[3],
                        const float (&direction)[3], TouchedCurve& best) {
    float a[3], b[3];
    edge_end(scene, edge, instance, 0, a);
    edge_end(scene, edge, instance, 1, b);
    // Project the edge onto the plane perpendicular to the ray, and find its point nearest to the ray.
    float w[3], t[3], wd = 0.0f, td = 0.0f;
    for (int k = 0; k < 3; ++k) {
        w[k] = a[k] - from[k], t[k] = b[k] - a[k];
        wd += w[k] * direction[k], td += t[k] * direction[k];
    }
    float wt = 0.0f, tt = 0.0f;
    for (int k = 0; k < 3; ++k) {
        const float w1 = w[k] - wd * direction[k], t1 = t[k] - td * direction[k];
        wt += w1 * t1, tt += t1 * t1;
    }
    if (!(tt > 0.0f)) return;
    const float u = -wt / tt < 0.0f ? 0.0f : -wt / tt > 1.0f ? 1.0f : -wt / tt;
    float miss = 0.0f;
    const float along = wd + u * td;
    for (int k = 0; k < 3; ++k) {
        const float d = w[k] + u * t[k] - along * direction[k];
        miss += d * d;
    }
    if (!(along > 0.0f)) return;
    const float off = __builtin_sqrtf(miss) / along;
    if (!(off < best.off)) return;
    best = {};
    best.edge = edge, best.instance = instance, best.u = u, best.off = off;
}

// Tries the edges of a face.
EG_INLINE void try_edges(const SceneView& scene, const ScanTask& task, int32_t face, int32_t instance,
                         const float (&from)[3], const float (&direction)[3], TouchedCurve& best) {
    for (int c = 0; c < 3; ++c) {
        const int32_t first = task.face_edge[3 * static_cast<int64_t>(face) + c];
        int32_t edge = first;
        while (edge >= 0) {
            try_edge(scene, edge, instance, from, direction, best);
            edge = task.next_on_side ? task.next_on_side[edge] : first;
            if (edge == first) break;
        }
    }
}

// Tries the outline of a field near a hit of it, as `from` sees it from outside or from inside.
EG_INLINE void try_outline(const SceneView& scene, int32_t face, const float (&from)[3],
                           const float (&direction)[3], const float (&hit)[3], TouchedCurve& best) {
    const FieldView& f = field_of_face(scene, face);
    const double eye[3] = {static_cast<double>(from[0]), static_cast<double>(from[1]),
                           static_cast<double>(from[2])};
    const FieldViewer viewer = viewer_at(f, eye);
    double grid[3], view[3], point[3], normal[3];
    bool clear;
    f.place_in_grid(hit, grid);
    f.vector_in_grid(direction, view);
    if (!move_to_tangency(f, view, grid) || !pull_to_outline(f, viewer, grid, clear)) return;
    TouchedCurve found;
    viewer.direction(grid, view);
    const double side = clear ? 1.0 : -1.0;
    if (!touches_outside(f, grid, view, found.contact, side)) return;
    f.place_in_world(grid, point);
    f.gradient_in_world(spline_jet(f, grid).gradient, normal);
    double along = 0.0, square = 0.0, slope = 0.0;
    for (int k = 0; k < 3; ++k) along += (point[k] - eye[k]) * static_cast<double>(direction[k]);
    for (int k = 0; k < 3; ++k) {
        const double across = point[k] - eye[k] - along * static_cast<double>(direction[k]);
        square += across * across, slope += normal[k] * normal[k];
    }
    if (!(along > static_cast<double>(found.contact)) || !(slope > 0.0)) return;
    found.field = face;
    found.off = static_cast<float>(std::sqrt(square) / along);
    if (!(found.off < best.off)) return;
    for (int k = 0; k < 3; ++k) {
        found.point[k] = static_cast<float>(point[k]);
        found.normal[k] = static_cast<float>(side * normal[k] / std::sqrt(slope));
    }
    best = found;
}

// The largest angle by which a ray may miss a curve that it touches: the distance of the neighbours plus
// rounding.
EG_INLINE float reach_of(const SpecularChain& p, const SpecularChain& q, int level, int i, float distance) {
    const auto gap = [i](const Vec3& a, const Vec3& b) {
        const float x = a.x[i] - b.x[i], y = a.y[i] - b.y[i], z = a.z[i] - b.z[i];
        return __builtin_sqrtf(x * x + y * y + z * z);
    };
    const Vec3& from = p.from[level];
    const float size =
        __builtin_fabsf(from.x[i]) + __builtin_fabsf(from.y[i]) + __builtin_fabsf(from.z[i]) + distance;
    return 4.0f *
               (gap(p.direction[level], q.direction[level]) + gap(p.from[level], q.from[level]) / distance) +
           2e-5f * size / distance;
}

// The curve that the last ray touches, for neighbouring chains that differ at a vertex.
EG_INLINE TouchedCurve touched_curve(const SceneView& scene, const ScanTask& task, const SpecularChain& p,
                                     const SpecularChain& q, int level, int i) {
    TouchedCurve best;
    float distance = 3e38f;
    const SpecularChain* const both[2] = {&p, &q};
    for (const SpecularChain* c : both) {
        if (c->key[level][i] == kMissed || c->key[level][i] == kDead) continue;
        const Vec3 &o = c->from[level], &d = c->direction[level], &x = c->position[level];
        const float from[3] = {o.x[i], o.y[i], o.z[i]}, direction[3] = {d.x[i], d.y[i], d.z[i]};
        const float to[3] = {x.x[i], x.y[i], x.z[i]};
        const int32_t face = c->face[level][i];
        if (is_on_field(scene, face))
            try_outline(scene, face, from, direction, to, best);
        else
            try_edges(scene, task, face, c->instance[level][i], from, direction, best);
        float square = 0.0f;
        for (int k = 0; k < 3; ++k) square += (to[k] - from[k]) * (to[k] - from[k]);
        distance = __builtin_sqrtf(square) < distance ? __builtin_sqrtf(square) : distance;
    }
    return best.found() && best.off > reach_of(p, q, level, i, distance) ? TouchedCurve{} : best;
}

// The line where two surfaces pass through each other that the last ray touches, for neighbouring chains that
// meet both of them there.
EG_INLINE TouchedCurve touched_crossing(const SceneView& scene, const SpecularChain& p,
                                        const SpecularChain& q, int level, int i) {
    // The largest distance of the line from the places that the rays meet, in lengths of the ray
    constexpr double kNear = 1e-2;
    const SpecularChain* const both[2] = {&p, &q};
    if (p.key[level][i] < 0 || q.key[level][i] < 0) return {};
    if (p.face[level][i] == q.face[level][i] && p.instance[level][i] == q.instance[level][i]) return {};
    TouchedCurve found;
    CrossedSurface surfaces[2];
    for (int k = 0; k < 2; ++k) {
        const Int face = splat(both[k]->face[level][i]), instance = splat(both[k]->instance[level][i]);
        CrossedSide side;
        side.face = face;
        side.field = on_field(scene, splat(-1), face);
        surfaces[k] = crossed_surface(scene, side, placed_triangle(scene, face, instance).triangle, 0);
        found.crossed[k].face = face[0], found.crossed[k].instance = instance[0];
    }
    const Vector from = vector_of(p.from[level], i), ray = vector_of(p.direction[level], i),
                 met[2] = {vector_of(p.position[level], i), vector_of(q.position[level], i)};
    Vector point = (met[0] + met[1]) * 0.5;
    if (!pull_to_crossing(surfaces, point)) return {};
    const Vector way = point - from;
    const double along = dot(way, ray);
    if (!(along > 0.0)) return {};
    for (const Vector& x : met)
        if (!(length(point - x) < kNear * along)) return {};
    const auto reach = static_cast<double>(reach_of(p, q, level, i, static_cast<float>(along)));
    if (!(length(way - ray * along) < reach * along)) return {};
    found.point[0] = static_cast<float>(point.x), found.point[1] = static_cast<float>(point.y),
    found.point[2] = static_cast<float>(point.z);
    return found;
}

// The light of the table whose outline the last ray passes, for neighbouring chains that differ only in the
// lights that they meet before a vertex; no light, if surfaces pass through it there. Both chains are so near
// to the outline that rounding may put them on the same side of it.
EG_INLINE TouchedCurve touched_light(const SceneView& scene, const SpecularChain& p, const SpecularChain& q,
                                     const ChainChoices& choices, int level, int i) {
    constexpr float kRounding = 1e-3f;
    // Find what scattered the ray
    int last = level - 1, bounces = -1;
    while (last > 0 && choices.event[last][i] == kEventPasses) --last;
    for (int k = 0; k <= last; ++k) bounces += choices.event[k][i] != kEventPasses;
    const bool transmits = choices.event[last][i] & kEventTransmits;
    const int kind = transmits ? kTransmissionRay : kGlossyRay;
    const LightView& lights = scene.lights;
    TouchedCurve found;
    for (int k = 0; k < lights.all_sized(); ++k) {
        const int row = lights.sized[k];
        if (!shines_along(scene, row, p.mesh[last][i], kind, bounces)) continue;
        const auto rho = [&](const SpecularChain& c) {
            const Vec3 &from = c.from[level], &d = c.direction[level];
            const Vec3 x = {splat(from.x[i]), splat(from.y[i]), splat(from.z[i])};
            return met_outline(scene, splat(-1), splat(row), x, {splat(d.x[i]), splat(d.y[i]), splat(d.z[i])})
                .rho[0];
        };
        const float a = rho(p), b = rho(q);
        float off = __builtin_fabsf(0.5f * (a + b) - 1.0f);
        if ((a <= 1.0f) == (b <= 1.0f)) off = off < kRounding ? off + kRounding : found.off;
        if (!(off < found.off)) continue;
        found.light = row, found.off = off;
    }
    return found;
}

}  // namespace edgegrad::EDGEGRAD_ISA
