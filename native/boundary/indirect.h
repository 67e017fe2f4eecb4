// Indirect boundary term: what changes where an edge passes between two surfaces that light each other, seen
// in glossy reflection, through rough glass or in diffuse inter-reflection.
//
// Formula (S) of the derivations (boundary/segment.h), sampled from the edge outwards. With e(u) a point of
// an edge, w a direction in which all faces of the edge are on one side, y the surface behind e along -w and
// x the one before it along w:
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (de - lambda dx - (1 - lambda) dy).
// L(y) is the light that y scatters towards e, which the path tracer of pictures finds: what y emits by
// itself is the shadow term's. W(x) is what light at x counts for in the picture: where the camera sees x, f
// kappa |D . n|; where it sees x by way of others, what a chain of them brings (boundary/scattering_chain.h).
// One length of the chain is picked for each sample, so that a path of some length is one sample's alone.
#pragma once

#include "boundary/edge_sample.h"
#include "boundary/scattering_chain.h"
#include "boundary/segment.h"
#include "boundary/silhouette.h"
#include "path/run.h"
#include "path/start.h"

namespace edgegrad::EDGEGRAD_ISA {

// The samples of a task as paths of the path tracer.
EG_INLINE ImageTask light_paths(const BoundaryTask& task) {
    ImageTask paths{};
    paths.pixel_count = 1;
    paths.first_sample = static_cast<int32_t>(task.first);
    paths.samples = static_cast<int32_t>(task.count);
    paths.max_depth = task.max_depth;
    paths.seed = hash(task.seed ^ 0x7f4a7c15u);
    paths.limits = task.limits;
    paths.width = 1;
    paths.one_stream = true;
    return paths;
}

// Direction of light past the edge, in the sample's cell of directions; the density of its solid angle there.
EG_INLINE Vec3 cell_direction(const SceneView& scene, const BoundaryTask& task, const PieceSample& p,
                              Float& density) {
    Float u, v;
    sobol_pair(p.random.stream, p.random.sample, kPairEnvironment, u, v);
    const float width = 1.0f / static_cast<float>(task.direction_cells);
    const Int row = quotient(p.cell, task.direction_cells), column = p.cell - row * task.direction_cells;
    const Vec3 w =
        wedge_direction(scene, p, (to_float(column) + u) * width, (to_float(row) + v) * width, density);
    density = density * (1.0f / (width * width));
    return w;
}

// The points x and y of a segment, in lanes where the ray meets both.
struct SegmentEnds {
    Closest x, y;
    Float to_x, to_y;
    Vec3 aside;  // from y to where rays leave it
};

// Where y is nearer than rounding, the edge lies in its surface (derivations F3): rays leave it a step to the
// side that the edge's faces don't hide.
EG_INLINE Vec3 leave_contact(const SceneView& scene, Mask touched, Vec3 t, Vec3 hidden_side,
                             const Closest& y) {
    const Triangle triangle = placed_triangle(scene, y.face, y.instance).triangle;
    Vec3 across = cross(area_normal(triangle), t);
    across = across * (aside(triangle) / max(sqrt(dot(across, across)), 1e-30f));
    return select(touched, select(dot(across, hidden_side) > 0.0f, -across, across), zero3());
}

EG_INLINE SegmentEnds find_ends(const SceneView& scene, Mask active, const BoundarySegment& s, Vec3 t,
                                Vec3 w) {
    const Ignored ignored = {s.edge, s.instance};
    const Float rounding = 1e-5f * largest_component(s.point);
    const Int mask = splat(kScatteredRays);
    SegmentEnds ends;
    ends.aside = zero3();
    ends.x = intersect(scene, active, s.point, w, splat(0.0f), splat(__builtin_inff()), ignored,
                       embree::kIncoherent, mask);
    // Nearer than rounding the jump is that of what is seen of x, not of its light (derivations F3c).
    ends.x.hit &= ends.x.distance > rounding;
    ends.to_x = ends.x.distance;
    // The ray starts before the edge, so that a surface touching it isn't lost.
    ends.y = intersect(scene, ends.x.hit, s.point + w * rounding, -w, splat(0.0f), splat(__builtin_inff()),
                       ignored, embree::kIncoherent, mask);
    ends.to_y = max(ends.y.distance - rounding, 0.0f);
    const Mask touched = ends.y.hit & (ends.y.distance < 2.0f * rounding);
    if (any(touched)) ends.aside = leave_contact(scene, touched, t, s.sweep, ends.y);
    return ends;
}

// A sample of the term but for L(y), whose path is appended to the queue of `queued`; its new length.
EG_OUTLINE int sample_indirect(const SceneView& scene, const BoundaryTask& task, const DerivativeView& asked,
                               int at, PieceCursor& piece, Workspace& work, int queued, BoundarySegment& s) {
    PieceSample p = sample_piece(scene, task, at, piece);
    s.color = zero3();
    s.view.sx = s.view.sy = splat(kNowhere);
    s.edge = p.edge;
    s.instance = p.instance;
    s.u = p.u0 + (p.u1 - p.u0) * p.tau;
    s.point = p.a + p.t * s.u;
    Float density;
    const Vec3 w = cell_direction(scene, task, p, density);
    s.sweep = cross(p.t, w);
    s.sweep = s.sweep * occluder_side(scene, p, s.sweep);
    s.active = p.active & (dot(s.sweep, s.sweep) > 0.0f);
    if (!any(s.active)) return queued;
    const SegmentEnds ends = find_ends(scene, s.active, s, p.t, w);
    s.active &= ends.x.hit & ends.y.hit;
    s.towards = -w;
    s.reach = ends.to_x;
    s.distance = ends.to_y;
    s.lambda = select(s.active, ends.to_y / max(ends.to_x + ends.to_y, 1e-30f), 0.0f);
    s.y = still_far_end();
    s.y.face = select(s.active, ends.y.face, splat(-1)), s.y.instance = ends.y.instance;
    s.y.b1 = ends.y.b1, s.y.b2 = ends.y.b2;
    s.x = surface_point(scene, s.active, ends.x.face, ends.x.b1, ends.x.b2, w, ends.x.instance);
    s.x.mesh = ends.x.mesh;
    s.active = s.x.active;

    Float unused, choice, probability;
    sobol_pair(p.random.stream, p.random.sample, kPairStrategy, unused, choice);
    const Int length = chain_length(p, task.max_depth - 3, choice, probability);
    s.slides = length == 0;
    s.active &= segment_moves(scene, asked, s);
    if (!any(s.active)) return queued;
    const SeenLight seen =
        see_light(scene, task, p, s.active, ends.x, w, length, splat(kScatteredRays), true);
    s.active = seen.active;
    s.view = seen.view;
    turn_to(s.x, -s.view.direction);
    s.color = seen.weight * ((p.u1 - p.u0) * task.scale / (density * probability * p.density));
    if (!any(s.active)) return queued;
    return append_scattering(work, queued, s.active, lane_index() + at, s.point, -w, ends.y, ends.aside,
                             length + 2, seen.bounces, splat(static_cast<int>(kDiffuseRay)));
}

// Finds L(y) of all samples.
EG_OUTLINE BoundarySegment* trace_segments(const SceneView& scene, const BoundaryTask& task,
                                           const DerivativeView& asked, Workspace& work) {
    const int count = static_cast<int>(task.count);
    const size_t packets = static_cast<size_t>((count + W - 1) / W);
    auto* segments = static_cast<BoundarySegment*>(work.segments->grow(packets * sizeof(BoundarySegment), 0));
    PieceCursor piece = first_piece(task);
    int queued = 0;
    for (int at = 0; at < count; at += W)
        queued = sample_indirect(scene, task, asked, at, piece, work, queued, segments[at / W]);
    for (float* channel : work.radiance) __builtin_memset(channel, 0, sizeof(float) * task.count);
    work.hits.edges = &work.edges;
    if (queued > 0) run_paths(scene, light_paths(task), work, queued);
    for (int at = 0; at < count; at += W) {
        BoundarySegment& s = segments[at / W];
        Vec3 light;
        load3(light, work.radiance, at);
        s.color = s.color * light;
        s.active &= ~(largest_component(s.color) <= 0.0f);
    }
    return segments;
}

static void indirect_forward_kernel(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                    const DerivativeView& tangent, Splats& splats) {
    BoundarySegment* segments = trace_segments(scene, task, tangent, work);
    for (int at = 0; at < static_cast<int>(task.count); at += W) {
        BoundarySegment& s = segments[at / W];
        weigh(task, at, s);
        Forward mode{scene, tangent};
        if (any(s.active)) segment_blocks(mode, scene, tangent, s);
        write_splats(task, splats, at, s.active, s.view.sx, s.view.sy, mode.value);
    }
}

static void indirect_backward_kernel(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                     const float* adjoint, DerivativeView& gradient) {
    BoundarySegment* segments = trace_segments(scene, task, gradient, work);
    for (int at = 0; at < static_cast<int>(task.count); at += W) {
        BoundarySegment& s = segments[at / W];
        weigh(task, at, s);
        if (!any(s.active)) continue;
        const Vec3 a = adjoint_at(scene.camera, s.active, s.view.sx, s.view.sy, adjoint);
        Backward mode{scene, gradient, a};
        segment_blocks(mode, scene, gradient, s);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
