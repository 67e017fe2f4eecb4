// Edges in caustics (boundary/caustics/caustic_path.h): what x sees by mirrors and smooth glass of emissive
// meshes, of what hides light, and of surfaces that scatter it.
//
// The last ray, from p = m_K along D, touches the edge of direction t through e(u) where
//   g(p, D, theta) = (e - p) . (t x D) = 0
// (boundary/specular/chain_term.h). For a fixed p, dD delta(g) = du/r^2 with r = |e - p|, and dA_m |n . D|
// /r^2 is the solid angle of the directions w from e to m_K. So
//   dI = int du int dw (change of the measure) W(x) T (L- - L+) (-dg/dtheta).
// e is sampled on the edge, and w about it as between surfaces (boundary/terms/indirect.h), towards points of
// mirrors, or away from where light comes from that passes e on its way to a mirror (light beams). Creases
// count, too, as seen from all sides. Edges across which shading continues count as silhouettes alone.
#pragma once

#include "boundary/caustics/caustic_path.h"
#include "boundary/samples/aimed_direction.h"
#include "boundary/segment/silhouette.h"

namespace edgegrad::EDGEGRAD_ISA {

// The lanes whose edges count from all sides.
EG_INLINE Mask is_crease(const BoundaryTask& task, const SegmentSample& p) {
    Mask crease = p.active;
    for (int i = 0; i < W; ++i)
        if (crease[i] && task.continues[p.edge[i]]) crease[i] = 0;
    return crease;
}

// A direction from a point of an edge to m_K. Half of those that are not aimed are about the edge, and half
// to a point of a mirror, chosen by area. `face` and `instance` are those of the point, -1: there is none.
struct MirrorDirection {
    Vec3 w;
    Int face, instance;
    Aim aim;
    Float wedge;  // density of directions about the edge
    float cells;  // by which the other densities are multiplied

    // The density of all directions together (balance heuristic), if w meets a mirror at this distance.
    EG_INLINE Float density(const BoundaryTask& task, Float distance, Float facing) const {
        const auto area = static_cast<float>(task.mirrors.cumulative[task.mirrors.count]);
        const Float rest = 0.5f * (wedge + cells * distance * distance / (max(facing, 1e-20f) * area));
        if (!any(aim.known)) return rest;
        const Float aimed = cells * aimed_density(task.beams, aim, -w);
        return select(aim.known, kAimed * aimed + (1.0f - kAimed) * rest, rest);
    }
};

EG_OUTLINE MirrorDirection mirror_direction(const SceneView& scene, const BoundaryTask& task,
                                            const SegmentSample& p, Mask crease, Vec3 point) {
    Float u, v;
    const float cells = cell_numbers(task, p, u, v);
    MirrorDirection d;
    d.aim = aim_from(task.beams, p.active, point);
    const Mask aimed = take_aimed(d.aim.known, v);
    const Float aimed_v = v;
    const Mask by_area = p.active & ~aimed & (v < 0.5f);
    v = 2.0f * v - select(v < 0.5f, splat(0.0f), splat(1.0f));
    d.w = wedge_direction(scene, p, crease, u, v, d.wedge);
    d.face = d.instance = splat(-1);
    if (any(by_area)) {
        const MirrorFaces& mirrors = task.mirrors;
        Float rest = splat(0.0f);
        for (int i = 0; i < W; ++i) {
            if (!by_area[i]) continue;
            const double place = static_cast<double>(u[i]) * mirrors.cumulative[mirrors.count];
            const int64_t k = last_below(mirrors.cumulative, mirrors.count, place);
            d.face[i] = mirrors.face[k], d.instance[i] = mirrors.instance[k];
            rest[i] = static_cast<float>((place - mirrors.cumulative[k]) /
                                         (mirrors.cumulative[k + 1] - mirrors.cumulative[k]));
        }
        const Float root = sqrt(min(max(rest, 0.0f), splat(1.0f)));
        const Triangle t = placed_triangle(scene, select(by_area, d.face, splat(0)), d.instance).triangle;
        d.w = select(by_area, unit_vector(interpolate(t, 1.0f - root, v * root) - point), d.w);
    }
    if (any(aimed)) d.w = select(aimed, -aimed_direction(task.beams, d.aim, u, aimed_v), d.w);
    d.wedge = density_about(scene, task, p, crease, d.w, d.wedge * cells);
    d.cells = cells;
    return d;
}

// Samples edges behind chains. Returns the number of stored paths.
EG_OUTLINE int sample_caustic_edges(const SceneView& scene, const BoundaryTask& task, ChainCrossings& out) {
    SegmentCursor cursor = first_segment(task);
    const Int all = splat(kScatteredRays);
    int found = 0;
    for (int64_t at = 0; at < task.count; at += W) {
        SegmentSample p = sample_edge_segment(scene, task, at, cursor);
        p.active &= is_met(scene, p.edge, all);
        if (!any(p.active)) continue;
        const Float along = p.u0 + (p.u1 - p.u0) * p.tau;
        const Vec3 point = p.a + p.t * along;
        const Mask crease = is_crease(task, p);
        const MirrorDirection d = mirror_direction(scene, task, p, crease, point);
        p.active &= crease | (occluder_side(scene, p, cross(p.t, d.w)) != 0.0f);
        if (!any(p.active)) continue;
        // Find m_K, the sampled point or what the direction about the edge meets
        const ReceiverHit m = find_receiver(scene, p.active, point, -d.w, {p.edge, p.instance},
                                            {all, all, kDiffuseRay, splat(63 * kChainVertex)}, p.random);
        Mask active = p.active & m.found & (m.hit.distance > 1e-5f * largest_component(point)) &
                      ((d.face < 0) | ((m.hit.face == d.face) & (m.hit.instance == d.instance)));
        if (!any(active)) continue;
        const SurfacePoint s = hit_surface(scene, active, m.hit, d.w);
        active &=
            may_have(scene, s, active, kHasGlossy | kHasRefraction) & ~on_field(scene, active, m.hit.face);
        if (!any(active)) continue;
        const Float density = d.density(task, m.hit.distance, abs(dot(s.normal, d.w)));
        found = follow_caustic(
            scene, task, p, active, m.hit, -d.w, m.through * ((p.u1 - p.u0) / (density * p.density)), at, out,
            found, [](int, const BentLight&, int) EG_INLINE_LAMBDA { return true; },
            [&](int i, int n) EG_INLINE_LAMBDA {
                out.edge[n] = p.edge[i], out.edge_instance[n] = p.instance[i], out.u[n] = along[i];
            });
    }
    return found;
}

}  // namespace edgegrad::EDGEGRAD_ISA
