// Indirect boundary term, camera-sampled: edges that the camera sees in sharp lobes.
//
// This estimates the same integral as boundary/terms/indirect.h, over camera paths of the picture and, from
// their k-th vertex x, over points e of edges (derivations, C1 and I). With r = |x - e| and beta the path's
// throughput
//   dI = int ds beta sum over edges int du  f |n_s . w|/r^2 L(y)
//        sigma (t x w) . (de - lambda dx - (1 - lambda) dy).
// Samples that start at edges reach a lobe of width alpha only with a probability of about alpha^2. Here the
// lobes of x choose the edges (boundary/samples/edge_importance.h). Several candidates are drawn. One of them
// is chosen with a probability proportional to f |n_s . w| |t x w|/r^2, if it is a silhouette (resampled
// importance sampling, Talbot et al. 2005), so that only edges that contribute cost a path.
//
// Each lobe at the camera's first vertex belongs to one of the two estimators, by its alpha
// (camera_sampled_kinds). Lobes of later vertices do not matter, because samples that start at edges sample
// those lobes on their way to the camera.
#pragma once

#include "boundary/samples/edge_importance.h"
#include "boundary/samples/picture_cell.h"
#include "boundary/segment/camera_connection.h"
#include "boundary/segment/camera_subpath.h"
#include "boundary/segment/far_radiance.h"
#include "boundary/segment/hiding_edge.h"
#include "boundary/segment/scattering_chain.h"
#include "tasks/boundary_task.h"
#include "tasks/edge_tree_view.h"
#include "tasks/image_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Candidates per sample. More candidates reduce the variance, but each one costs a descent of the tree.
constexpr int kCameraSampledCandidates = 8;
// The first vertex number for the random numbers of the last vertex: those of its lobe direction, then those
// of the candidates.
constexpr int kLobeVertex = 1 << 20;

// A surface that scatters a path, prepared for evaluations of many directions.
struct CameraSampledSurface {
    const ScatteringPoint& at;
    Mask lambertian, others;
    Lambertian flat;
    ShadedSurface rest;

    // What is `followed` is left out: scan lines find it.
    EG_INLINE CameraSampledSurface(const SceneView& scene, const ScatteringPoint& s, Mask active,
                                   const Followed& followed)
        : at(s),
          lambertian(active & has(s.shader, kLambertian)),
          others(active & ~lambertian),
          flat{s.normal, s.x.normal, s.shader.color(kBaseColor),
               scene.all_flags & kHasNormalMap ? &s.point.normal : nullptr} {
        if (any(others)) rest = shaded_surface(scene, others, s.x, s.point, s.shader, s.normal);
        if (any(others & (followed.widest > 0.0f))) follow_lobes(rest.bsdf, others, followed);
    }
    // f |n_s . w| for light from w, of lobes that scatter `kinds` (bits 1 << RayKind). Compiled once: copies
    // of all lobes in each caller would only compile slowly.
    EG_NOINLINE Vec3 evaluate(Mask m, Vec3 w, Int kinds) const {
        const Float above = dot(at.x.normal, w);
        Vec3 value = zero3();
        const Mask lit = m & lambertian & (above > 0.0f);
        if (any(lit)) value = select(lit, flat.evaluate_for(kinds, lit, w).value, value);
        const Mask reached = m & others & (at.both_sides | (above > 0.0f));
        if (any(reached)) {
            const bool all = !any(reached & ((kinds & kScatteredRays) != kScatteredRays));
            value = select(reached, evaluate_kinds(rest, all, kinds, reached, w).value, value);
        }
        return value;
    }
    // Samples a direction from the lobes that are not perfect.
    EG_INLINE BsdfSample sample(Mask m, Float lobe, Float u, Float v) const {
        BsdfSample s = flat.sample(m & lambertian, lobe, u, v);
        if (any(m & others)) {
            BsdfSample r = rest.sample(m & others, lobe, u, v);
            r.active &= ~r.specular;
            s = select(others, r, s);
        }
        return s;
    }
};

// The squared width s^2 of the kernel about a direction that was sampled with this density. A kernel wider
// than a quarter of the sphere is nearly uniform.
EG_INLINE Float width2_of(Float density) {
    return clamp(0.318309886f / max(density, 1e-6f), splat(1e-6f), splat(1.0f));
}

// Samples a direction of x's lobes that scatter `kinds`: the one of largest density among several samples of
// one lobe. The density of an edge in the centre of the lobe decreases with the square of the distance of
// that direction. With a single sample the weight, which is the reciprocal, would have infinite variance.
EG_OUTLINE LobeDirection sample_lobe_direction(const CameraSampledSurface& surface, Mask active, Int kinds,
                                               Float lobe_u, const PathIndex& random) {
    LobeDirection around{surface.at.x.position, surface.at.x.normal, splat(1.0f)};
    Float densest = splat(0.0f);
    Int lobe = splat(-1);
    for (int k = 0; k < 6; ++k) {
        const auto [u, v] = sobol_pair(random, vertex_pair(splat(kLobeVertex + k), kVertexDirection));
        const BsdfSample s = surface.sample(active, lobe_u, u, v);
        const Mask found = active & s.active & ((kinds & ray_mask(s.ray_kind)) != 0) & (s.pdf > densest) &
                           ((lobe < 0) | ((s.lobe + 64 * s.ray_kind) == lobe));
        lobe = select(found, s.lobe + 64 * s.ray_kind, lobe);
        densest = select(found, s.pdf, densest);
        around.towards = select(found, s.wi, around.towards);
    }
    around.width2 = select(lobe >= 0, width2_of(densest), around.width2);
    return around;
}

// A point of an edge, as seen from x.
struct CameraSampledPoint {
    Mask active;
    Int edge, instance;
    Vec3 a, t;
    Float u, reach;
    Vec3 towards;  // from x to the point, unit
    Vec3 color;    // f |n_s . w|/r^2 over the density of u
};

// The running sums of the top nodes' weights for x.
struct TopNodes {
    Float sum[kMostTopNodes];
};

// Chooses a point of an edge near a direction. counts(m, towards, r): which candidates at the distance r may
// contribute.
template <typename Counts>
EG_OUTLINE CameraSampledPoint choose_edge_point(const EdgeTreeView& tree, const CameraSampledSurface& surface,
                                                Mask active, Int kinds, const LobeDirection& around,
                                                const PathIndex& random, int candidates,
                                                const Counts& counts) {
    CameraSampledPoint out;
    out.active = splat(0);
    out.edge = splat(0), out.instance = splat(-1);
    out.a = out.t = out.color = zero3();
    out.towards = around.towards;
    out.u = out.reach = splat(0.0f);
    // Weight the top nodes of the tree
    TopNodes top;
    Float all = splat(0.0f);
    for (int k = 0; k < tree.top_count; ++k) {
        all = all + weigh_node(broadcast_node(tree.nodes[tree.top[k]]), around);
        top.sum[k] = all;
    }
    active &= all > 0.0f;
    const Float rounding = 1e-6f * largest_component(around.position);
    Float total = splat(0.0f), taken = total;
    for (int k = 0; k < candidates && any(active); ++k) {
        const Int vertex = splat(kLobeVertex + 8 + k);
        const auto [by_tree, by_place] = sobol_pair(random, vertex_pair(vertex, kVertexDirection));
        const Float by_weight = sobol_pair(random, vertex_pair(vertex, kVertexChoice)).u;
        // Stratify the candidates' places in the tree.
        const Float mark = (by_tree + static_cast<float>(k)) * (1.0f / static_cast<float>(candidates)) * all;
        Int node = splat(-1);
        Float low = splat(0.0f), share = low;
        for (int j = 0; j < tree.top_count; ++j) {
            // If rounding leaves the mark beyond the last node, take the last node of nonzero weight.
            const Float before = j > 0 ? top.sum[j - 1] : splat(0.0f), here = top.sum[j] - before;
            const Mask at = (here > 0.0f) & ((mark >= before) | (node < 0));
            node = select(at, splat(tree.top[j]), node);
            low = select(at, before, low);
            share = select(at, here, share);
        }
        // Descend the tree and sample a point of the segment
        Mask here = active & (node >= 0);
        Float probability = share / max(all, 1e-38f);
        Float within = clamp((mark - low) / max(share, 1e-38f), splat(0.0f), splat(0.99999994f));
        const Int leaf =
            walk_down(tree.nodes, select(here, node, splat(0)), here, within, probability,
                      [&](const NodePacket& n) EG_INLINE_LAMBDA { return weigh_node(n, around); });
        if (!any(here)) continue;
        Float row[kSegmentColumns];
        gather_row(tree.pieces, kSegmentColumns, select(here, -1 - leaf, splat(0)), row);
        const auto vector = [&](int at) { return Vec3{row[at], row[at + 1], row[at + 2]}; };
        const Vec3 a = vector(kSegmentFrom), t = vector(kSegmentAlong);
        const PlaceOnEdge place =
            choose_place(around, here, a, t, row[kSegmentU0], row[kSegmentU1], by_place);
        const Vec3 way = a + t * place.u - around.position;
        const Float r2 = dot(way, way), r = sqrt(r2);
        const Vec3 towards = way * (1.0f / max(r, 1e-30f));
        // Keep silhouettes, including edges that rounding cannot tell from silhouettes.
        const Float side0 = dot(vector(kSegmentNormal), way), side1 = dot(vector(kSegmentNormal + 3), way);
        const Float near = 1e-5f * r + rounding;
        here = place.active & (r2 > 0.0f) & ~((side0 > near) & (side1 > near)) &
               ~((side0 < -near) & (side1 < -near));
        here = counts(here, towards, r);
        if (!any(here)) continue;
        // Choose among the candidates by resampling
        const Vec3 across = cross(towards, t);
        const Vec3 value = surface.evaluate(here, towards, kinds) * (1.0f / max(r2, 1e-30f));
        const Float target = select(here, largest_component(value) * sqrt(dot(across, across)), 0.0f);
        const Float weight = target / max(probability * place.density, 1e-30f);
        total = total + weight;
        const Mask take = (target > 0.0f) & (by_weight * total < weight);
        taken = select(take, target, taken);
        out.active |= take;
        out.edge = select(take, bits(float_bits(row[kSegmentEdge])), out.edge);
        out.instance = select(take, bits(float_bits(row[kSegmentInstance])), out.instance);
        out.a = select(take, a, out.a), out.t = select(take, t, out.t);
        out.u = select(take, place.u, out.u), out.reach = select(take, r, out.reach);
        out.towards = select(take, towards, out.towards);
        out.color = select(take, value, out.color);
    }
    out.color = out.color * (total / max(taken * static_cast<float>(candidates), 1e-38f));
    return out;
}

// Scan lines follow lobes of vertices that the camera sees up to this alpha.
EG_INLINE Float followed_in_picture(const SceneView& scene, const BoundarySegment& s) {
    return select(s.screen_form, splat(scene.followed_alpha), 0.0f);
}

// A task's samples as paths of the picture.
EG_INLINE ImageTask camera_sampled_paths(const BoundaryTask& task) {
    return sample_paths(task, 1, hash(task.seed ^ 0x1b873593u));
}

// Starts these paths and finds their first hits.
EG_INLINE PathPacket start_walk(const SceneView& scene, const BoundaryTask& task, Mask active, Int path,
                                Float sx, Float sy, const PathIndex& random, Closest& hit) {
    const auto [lens_u, lens_v] = lens_numbers(scene.camera, random);
    PathPacket p = first_segment(task.max_depth);
    p.active = active;
    p.path = path;
    hit = trace_first(scene, p, sx, sy, lens_u, lens_v, embree::kIncoherent);
    return p;
}

// A path of the picture, with which a camera-sampled sample starts.
struct PicturePath {
    SegmentSample segment;
    Float weight;  // of the sample
    Int length;    // vertices before x
    Closest hit;   // the first
    Vec3 first;
    PathPacket path;
};

// Starts the paths of samples at `at`, with at most `longest` vertices before x. Initialises their segments.
EG_INLINE PicturePath start_in_picture(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                       SegmentCursor& cursor, int longest, BoundarySegment& s) {
    PicturePath w;
    w.segment = sample_edge_segment(scene, task, at, cursor);
    s.color = zero3();
    s.view.sx = s.view.sy = splat(kNowhere);
    s.active = splat(0);
    s.edge = w.segment.edge, s.instance = w.segment.instance;
    s.y = still_far_end();
    s.fixed.length = splat(0);
    Float probability, sx, sy;
    w.length = chain_length(w.segment, longest, probability);
    s.screen_form = w.length == 0;
    w.weight = place_in_cell(scene, task, w.segment, sx, sy) * task.scale / probability;
    w.path = start_walk(scene, task, w.segment.active, lane_index() + static_cast<int32_t>(at), sx, sy,
                        w.segment.random, w.hit);
    w.first = w.path.origin + w.path.direction * w.hit.distance;
    return w;
}

// Removes what followed lobes alone contribute to vertices that the camera does not see directly. Scan lines
// estimate that (boundary/specular/chain_term.h).
EG_INLINE void leave_followed(const SceneView& scene, Mask seen, Vec3 followed, PathPacket& path) {
    if (!(scene.followed_alpha > 0.0f)) return;
    path.throughput = select(seen, path.throughput, without_followed(path.throughput, followed));
    path.active &= largest_component(path.throughput) > 0.0f;
}

// Continues such a path to x, from its first vertex by the camera-sampled lobes alone. `of_table`: lanes with
// shadows of lights of the table and of emissive meshes. Sets the parts of the throughput.
EG_INLINE void walk_by_sharp_lobes(const SceneView& scene, const BoundaryTask& task, const ImageTask& walks,
                                   Mask of_table, PicturePath& begun, BoundarySegment& s, WalkParts& parts) {
    PathPacket& path = begun.path;
    if (scene.mesh_contact) begin_fixed_direction_chain(scene, path.active, begun.length, s.fixed);
    walk_camera_paths(scene, walks, path, begun.hit, begun.length + 1, {task.camera_sampled, of_table},
                      &s.fixed, &parts);
    leave_followed(scene, s.screen_form, parts.followed, path);
}

// Samples an edge near a direction from x, one of `candidates` (choose_edge_point), and sets it in the
// segment and in `p`. Returns f |n_s . w|/r^2 over the density of the point.
template <typename Counts>
EG_INLINE Vec3 sample_edge_near(const SceneView& scene, const BoundaryTask& task, const ScatteringPoint& x,
                                const CameraSampledSurface& surface, Int kinds, const LobeDirection& around,
                                int candidates, const Counts& counts, SegmentSample& p, BoundarySegment& s) {
    const CameraSampledPoint e =
        choose_edge_point(task.tree, surface, s.active, kinds, around, p.random, candidates, counts);
    p.active = s.active &= e.active;
    p.edge = s.edge = e.edge;
    p.instance = s.instance = e.instance;
    p.a = e.a, p.t = e.t;
    s.u = e.u;
    s.point = e.a + e.t * e.u;
    s.towards = e.towards;
    s.x = x.x;
    s.reach = e.reach;
    return e.color * share_of_edge(scene, s.active, e.edge);
}

// The same near a direction of x's lobes.
EG_INLINE Vec3 sample_edge_in_lobes(const SceneView& scene, const BoundaryTask& task,
                                    const ScatteringPoint& x, const CameraSampledSurface& surface, Int kinds,
                                    const PathIndex& walk, Int vertex, int candidates, SegmentSample& p,
                                    BoundarySegment& s) {
    const Float lobe = sobol_pair(walk, vertex_pair(vertex, kVertexChoice)).v;
    const LobeDirection around = sample_lobe_direction(surface, s.active, kinds, lobe, p.random);
    return sample_edge_near(
        scene, task, x, surface, kinds, around, candidates,
        [](Mask m, Vec3, Float) EG_INLINE_LAMBDA { return m; }, p, s);
}

// Samples the term without L(y). Appends the path that estimates L(y) to the queue of length `queued`, and
// returns the new length.
EG_OUTLINE int sample_from_camera(const SceneView& scene, const BoundaryTask& task,
                                  const DerivativeView& requested, int at, SegmentCursor& cursor,
                                  Workspace& work, int queued, BoundarySegment& s) {
    // Follow a path of the picture to x
    PicturePath begun = start_in_picture(scene, task, at, cursor, task.max_depth - 3, s);
    SegmentSample& p = begun.segment;
    PathPacket& path = begun.path;
    const ImageTask walks = camera_sampled_paths(task);
    WalkParts parts;
    walk_by_sharp_lobes(scene, task, walks, splat(0), begun, s, parts);
    if (!any(path.active)) return queued;
    // Sample an edge in the lobes of x
    const ScatteringPoint x = scattering_point(scene, walks, path, path.active, begun.hit);
    const Int kinds =
        select(s.screen_form, camera_sampled_kinds(x.shader, {task.camera_sampled}), splat(kScatteredRays));
    s.active = x.x.active & (kinds != 0);
    if (!any(s.active)) return queued;
    const CameraSampledSurface surface(scene, x, s.active, followed_in_picture(scene, s));
    const PathIndex walk = path_index(walks, path.path);
    const Vec3 value = sample_edge_in_lobes(scene, task, x, surface, kinds, walk, path.vertex,
                                            kCameraSampledCandidates, p, s);
    if (!any(s.active)) return queued;

    const HidingEdge edge = hide_behind(scene, p, x.x, s);
    // Skip samples outside the picture or beyond the bounce limits
    s.view = place_in_picture(scene, s.active, select(s.screen_form, x.x.position, begun.first), p.random);
    s.active &= s.view.active;
    if (scene.rays_differ) s.active &= is_met(scene, s.edge, splat(kScatteredRays));
    Int bounces = path.bounces & 0xffffff;
    s.active &= scatters_within_limits(
        scene, task, s.active, x.x, s.towards, kinds, walk, path.vertex,
        [&](Int some) EG_INLINE_LAMBDA { return surface.evaluate(s.active, s.towards, some); }, bounces);
    if (!any(s.active)) return queued;

    // Find the transmittance from x to the edge, and the surface behind the edge.
    const Vec3 start = leave_surface(x.x, s.towards);
    const Vec3 seen =
        transmittance(scene, s.active, start, s.point - start, splat(0.99999f),
                      {splat(kScatteredRays), kDiffuseRay, task.limits.transparent, {s.edge, s.instance}});
    s.active &= largest_component(seen) > 0.0f;
    if (!any(s.active)) return queued;
    const LightSource y = find_source(scene, task, s, s.active, path.path, p.t, -s.towards);
    s.active &= y.hit.hit;
    s.distance = y.distance;
    divide_segment(s);
    s.y.face = select(s.active, y.hit.face, splat(-1));
    s.y.instance = y.hit.instance, s.y.b1 = y.hit.b1, s.y.b2 = y.hit.b2;
    blend_near_contact(scene, begun.length, s);
    s.active &= segment_moves(scene, requested, s);
    if (!any(s.active)) return queued;

    // Evaluate the sample and queue the path of L(y)
    s.color = path.throughput * value * seen * (x.shader.scale * begun.weight);
    color_of_jump(scene, p, edge, s);
    return append_scattering(
        work, queued, s.active, path.path, s.point, s.towards, y.hit, y.aside,
        y.through * kept_before_start(scene, s.active, y.hit, s.point, s.towards, s.reach), y.passed,
        begun.length + 2, bounces, splat(kDiffuseRay));
}

}  // namespace edgegrad::EDGEGRAD_ISA
