// Primary boundary term: an edge that the camera sees sweeps over the picture.
//
// e(u) is a point of an edge of direction t = b - a (not normalised), D the direction of the camera's ray
// through e, kappa the picture's area per area perpendicular to D (path/camera_projection.h), and c the
// velocity of that ray at e. Then (derivations, formula P and section B)
//   dI = int du (L- - L+) kappa N . (de - c),    N = D x t.
// L+ and L- are the radiance just beside the edge, on the sides of +N and -N. On each side it comes from the
// nearest of the edge's faces there or, without a face, from the surface behind the edge. A near face is hit
// by construction. One ray, which ignores the edge's faces, finds the surface behind. From there the
// picture's path tracer estimates both sides with the same random numbers.
//
// Edges are sampled by their length in the picture and the size of the expected jump
// (boundary/samples/edge_weights.h). The point is uniform on the projected edge.
//
// The line along which two faces intersect is an edge as well (derivations, F1). Its point e lies on both
// planes. With N = mu_1 n_1 + mu_2 n_2, N . de = mu_1 n_1 . m_1 + mu_2 n_2 . m_2, where m_k are the material
// velocities of the two faces at e.
#pragma once

#include "boundary/samples/intersection_point.h"
#include "boundary/samples/moving_points.h"
#include "boundary/samples/visible_edge.h"
#include "path/start.h"
#include "reparameterisation/camera_blocks.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// A task's samples as paths of the path tracer: those of the plus side, then those of the minus side.
EG_INLINE ImageTask side_paths(const BoundaryTask& task) {
    return sample_paths(task, 2, boundary_stream(task));
}

// Moves barycentrics from the point of the edge to the place where rays beside it start, in lanes where the
// textures of the face may jump: else a border along the edge itself, such as the end of the texture space,
// could give the value of the wrong side.
EG_INLINE void leave_border(const SceneView& scene, const EdgeSample& s, Int face, Int instance, Vec3 step,
                            Float& b1, Float& b2) {
    if (!scene.material_jumps) return;
    const Mask jumps =
        s.active &
        (gather(scene.material_jumps, gather(scene.face_material, select(s.active, face, splat(0)))) != 0);
    if (!any(jumps)) return;
    Float c1, c2;
    place_in_face(placed_triangle(scene, jumps, face, instance).triangle, s.point + step, c1, c2);
    b1 = select(jumps, c1, b1);
    b2 = select(jumps, c2, b2);
}

// The hit on one side: the near face at the point of the edge, or the surface behind it. The point is the
// edge point itself. So all shading that is continuous across the edge (smooth normals, textures, light
// samples) is equal on both sides. Rays leave the surface at the offset `aside`.
[[maybe_unused]] EG_OUTLINE Closest side_hit(const SceneView& scene, const EdgeSample& s, const Sides& sides,
                                             const SideFace& near, const Int& mesh, const Behind& behind,
                                             Vec3 outwards, Float slope_behind, Vec3& aside) {
    const Mask touched = s.active & behind.touched;
    // A face behind the surface that contains the edge is not visible. If both lie in one plane up to
    // rounding, the nearer one occludes the other.
    const Float lower = near.slope - slope_behind;
    const Float size = abs(near.slope) + abs(slope_behind) + sqrt(dot(s.tangent, s.tangent));
    const Mask hides = select(abs(lower) < 1e-5f * size, behind.hit.distance < s.view.distance, lower > 0.0f);
    const Mask is_near = s.active & (near.face >= 0) & ~(touched & hides);
    Closest hit = behind.hit;
    aside = zero3();
    // Take the surface that contains the edge
    if (any(touched & ~is_near)) {
        Float b1, b2;
        aside = select(touched, touched_point(scene, s, behind.hit, outwards, b1, b2), aside);
        hit.b1 = select(touched, b1, hit.b1);
        hit.b2 = select(touched, b2, hit.b2);
    }
    if (!any(is_near)) return hit;
    // Take the near face
    SideFace face = near;
    face.face = select(is_near, near.face, splat(-1));
    Float b1, b2;
    const Vec3 step = near_point(scene, s, face, outwards, b1, b2);
    leave_border(scene, s, select(is_near, face.face, splat(0)), face.instance, step, b1, b2);
    aside = select(is_near, select(sides.narrow | touched | s.intersection, step, zero3()), aside);
    return select(is_near, {is_near, near.face, mesh, near.instance, b1, b2, s.view.distance}, hit);
}

// Lanes in which both sides belong to two faces that meet at an obtuse angle and share a Lambertian material
// without emission or transparency. One path then estimates both sides (path/edge_step.h).
EG_INLINE Mask bent_lambertian(const SceneView& scene, const EdgeSample& s, const Sides& sides,
                               Mask touched) {
    if (scene.any_terminator) return splat(0);
    Mask bends =
        ~s.intersection & ~touched & ~sides.narrow & (sides.plus.face >= 0) & (sides.minus.face >= 0);
    if (!any(bends)) return bends;
    const Int material = gather(scene.face_material, select(bends, sides.plus.face, splat(0)));
    bends &= material == gather(scene.face_material, select(bends, sides.minus.face, splat(0)));
    const Int closure = gather(scene.material_first_closure, material);
    bends &= gather(scene.material_first_closure + 1, material) == closure + 1;
    const Int flags = gather(scene.closure_flags, select(bends, closure, splat(0)));
    constexpr int32_t kPlain = kLambertian, kOther = kHasEmission | kHasTransparency | kHasNormalMap;
    return bends & ((flags & kPlain) != 0) & ((flags & kOther) == 0);
}

// Appends the path of one side of samples, which shares nothing with that of the other side: it has met `hit`
// along `direction`, after what is before the curve, and leaves at the offset `aside`.
EG_INLINE int start_side(const BoundaryTask& task, Workspace& work, int queued, const EdgeSample& s, Int path,
                         Vec3 direction, const Closest& hit, Vec3 aside, const Behind& before) {
    Closest other = hit;
    other.hit = splat(0);
    return append_start(work, queued, s.active, path, s.view.origin, direction, hit, aside, other,
                        before.through, before.passed, task.max_depth);
}

// A packet of samples, kept while their paths are traced. `active` are the visible samples that contribute.
struct TracedSample {
    EdgeSample sample;
    Vec3 factor;  // multiplies the jump
};

// What a mode multiplies the jump of a sample by. A call by address lets both modes share the code that
// traces the samples.
template <typename Traced>
struct FactorOf {
    template <typename Mode>
    explicit FactorOf(const Mode& mode)
        : mode_(&mode),
          call_([](const void* m, const Traced& kept) { return (*static_cast<const Mode*>(m))(kept); }) {}
    Vec3 operator()(const Traced& kept) const { return call_(mode_, kept); }

 private:
    const void* mode_;
    Vec3 (*call_)(const void*, const Traced&);
};

// Sets the factor of samples and drops those whose factor is zero, except in a first pass, which needs all
// sizes (weigh).
template <typename Traced>
EG_INLINE void set_factor(const BoundaryTask& task, Traced& kept, const FactorOf<Traced>& factor) {
    if (!any(kept.sample.active)) return;
    kept.factor = factor(kept);
    if (!task.score) kept.sample.active &= ~(largest_component(kept.factor) == 0.0f);
}

// Estimates the radiance of both sides of a task's samples into work.radiance: Curves::start samples the
// points of a packet and appends the paths of both sides. Returns what it has kept of each packet.
template <typename Curves>
EG_OUTLINE typename Curves::Traced* trace_sides(const SceneView& scene, const BoundaryTask& task,
                                                Workspace& work,
                                                const FactorOf<typename Curves::Traced>& factor) {
    using Traced = typename Curves::Traced;
    const int count = static_cast<int>(task.count);
    const auto packets = static_cast<size_t>((count + W - 1) / W);
    auto* const traced = static_cast<Traced*>(work.segments->grow(packets * sizeof(Traced), 0));
    SegmentCursor cursor = first_segment(task);
    int queued = 0;
    for (int at = 0; at < count; at += W)
        Curves::start(scene, task, work, factor, traced[at / W], at, cursor, queued);
    run_appended(scene, side_paths(task), work, queued, 2 * task.count);
    return traced;
}

// L- - L+ of the samples from `at` on.
EG_INLINE Vec3 jump_of(const BoundaryTask& task, const Workspace& work, int at) {
    Vec3 plus, minus;
    load3(plus, work.radiance, at);
    load3(minus, work.radiance, static_cast<int>(task.count) + at);
    return minus - plus;
}

// One of the two faces of an intersection line.
struct IntersectionFace {
    Int face, instance;
    Vec3 normal;
};

EG_INLINE IntersectionFace intersection_face(const SceneView& scene, const EdgeSample& s, Mask intersection,
                                             uint32_t k) {
    IntersectionFace f = {splat(0), splat(-1), zero3()};
    for (int i = 0; i < W; ++i) {
        if (!intersection[i]) continue;
        f.face[i] = scene.surface_of_line(s.edge[i], k).face();
        f.instance[i] = face_instance(scene, s.edge[i], s.instance[i], k);
    }
    f.normal = unit_normal(placed_triangle(scene, f.face, f.instance).triangle);
    return f;
}

// Adds the velocity of an intersection line of two faces.
template <typename Mode>
EG_OUTLINE void intersection_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                    const EdgeSample& s, Mask intersection, Vec3 g, Vec3 color) {
    const IntersectionFace one = intersection_face(scene, s, intersection, 0),
                           other = intersection_face(scene, s, intersection, 1);
    Float mu, mu_other;
    part_normals(g, one.normal, other.normal, mu, mu_other);
    plane_point_blocks(mode, scene, motion, intersection, one.face, one.instance, s.point, one.normal * mu,
                       color);
    plane_point_blocks(mode, scene, motion, intersection, other.face, other.instance, s.point,
                       other.normal * mu_other, color);
}

// Adds weight N . (-c), times `color`, for the requested parameters of the camera.
template <typename Mode>
EG_INLINE void view_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                           const EdgeSample& s, Vec3 color) {
    camera_blocks(mode, scene, motion, s.active, s.view, s.normal * s.weight, -color);
}

// Adds weight N . (de - c), times `color`, for the requested parameters.
template <typename Mode>
EG_INLINE void edge_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                           const EdgeSample& s, Vec3 color) {
    const Vec3 g = s.normal * s.weight;
    view_blocks(mode, scene, motion, s, color);
    const Mask intersection = s.active & s.intersection;
    if (any(intersection)) intersection_blocks(mode, scene, motion, s, intersection, g, color);
    const Mask on_edge = s.active & ~s.intersection;
    if (any(on_edge)) edge_point_blocks(mode, scene, motion, on_edge, s.edge, s.instance, s.u, g, color);
}

// What the kernels below need of the edges and intersection lines of meshes. Other curves have their own
// (boundary/terms/field_outline.h).
struct MeshCurves {
    using Traced = TracedSample;

    EG_INLINE static void start(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                const FactorOf<TracedSample>& factor, TracedSample& kept, int at,
                                SegmentCursor& cursor, int& queued) {
        const int count = static_cast<int>(task.count);
        EdgeSample& s = kept.sample;
        // Sample a point of an edge
        s = sample_edge(scene, task, at, cursor);
        set_factor(task, kept, factor);
        // Find the faces on both sides and the surface behind
        Sides sides = visible_faces(scene, s);
        // An edge that is seen end-on has no face on either side, and no jump.
        s.active &= (sides.plus.face >= 0) | (sides.minus.face >= 0);
        Behind behind;
        if (any(s.active)) behind = look_behind(scene, s, sides, task.limits.transparent, EdgeFaces{});
        if (!any(s.active)) return;
        // Start a path on each side
        const Float slope = any(behind.touched) ? touched_slope(scene, s, behind.hit) : splat(0.0f);
        const Int path = lane_index() + at;
        Vec3 aside[2];
        const auto met = [&](const SideFace& near, Vec3 outwards, Float slope_behind,
                             Vec3& step) EG_INLINE_LAMBDA {
            const Int mesh = mesh_of(scene, select(near.face >= 0, near.face, splat(0)));
            return side_hit(scene, s, sides, near, mesh, behind, outwards, slope_behind, step);
        };
        const Closest plus = met(sides.plus, s.normal, slope, aside[0]);
        const Closest minus = met(sides.minus, -s.normal, -slope, aside[1]);
        const Mask bends = s.active & bent_lambertian(scene, s, sides, behind.touched);
        const auto start = [&](Mask active, Int number, const Closest& hit, Vec3 step,
                               const Closest& other) EG_INLINE_LAMBDA {
            queued = append_start(work, queued, active, number, s.view.origin, s.view.direction, hit, step,
                                  other, behind.through, behind.passed, task.max_depth);
        };
        Closest other = minus;
        other.hit = bends;
        start(s.active, path, plus, aside[0], other);
        other.hit = splat(0);
        if (any(s.active & ~bends)) start(s.active & ~bends, path + count, minus, aside[1], other);
    }
    template <typename Mode>
    EG_INLINE static void blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                 const TracedSample& traced, Vec3 color) {
        edge_blocks(mode, scene, motion, traced.sample, color);
    }
};

// The area of the picture that the edge sweeps per unit of the tangent.
template <typename Curves>
EG_INLINE Float sweep(const SceneView& scene, const DerivativeView& tangent,
                      const typename Curves::Traced& traced) {
    Forward mode{scene, tangent};
    Curves::blocks(mode, scene, tangent, traced, {splat(1.0f), splat(0.0f), splat(0.0f)});
    return mode.value.x;
}

// Drops samples of infinite size. Writes the sizes of a first pass, by which the second pass is distributed:
// the jump times the area that a unit motion across the edge sweeps. A size contains neither tangent nor
// adjoint, so that both modes use the same samples and are exact transposes of each other.
EG_INLINE void weigh(const BoundaryTask& task, int at, EdgeSample& s, Vec3 jump) {
    const Float size = size_of(jump) * abs(s.weight) * sqrt(dot(s.normal, s.normal));
    s.active = weigh_samples(task, at, s.active, s.edge, s.instance, size);
}

template <typename Curves>
static void primary_forward_kernel(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                   const DerivativeView& tangent, Splats& splats) {
    // Trace only samples that move.
    using Traced = typename Curves::Traced;
    const auto factor = [&](const Traced& kept) { return gray(sweep<Curves>(scene, tangent, kept)); };
    Traced* traced = trace_sides<Curves>(scene, task, work, FactorOf<Traced>(factor));
    for (int at = 0; at < static_cast<int>(task.count); at += W, ++traced) {
        EdgeSample& s = traced->sample;
        Vec3 value = zero3();
        if (any(s.active)) {
            const Vec3 jump = jump_of(task, work, at);
            weigh(task, at, s, jump);
            value = jump * traced->factor;
        }
        write_splats(task, splats, at, s.active, s.view.sx, s.view.sy, value);
    }
}

template <typename Curves>
static void primary_backward_kernel(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                    const float* adjoint, DerivativeView& gradient) {
    // Trace only samples whose pixel has an adjoint.
    using Traced = typename Curves::Traced;
    const auto factor = [&](const Traced& kept) {
        const EdgeSample& s = kept.sample;
        return adjoint_at(scene.camera, s.active, s.view.sx, s.view.sy, adjoint);
    };
    Traced* traced = trace_sides<Curves>(scene, task, work, FactorOf<Traced>(factor));
    for (int at = 0; at < static_cast<int>(task.count); at += W, ++traced) {
        EdgeSample& s = traced->sample;
        if (!any(s.active)) continue;  // neither score nor contribution
        const Vec3 jump = jump_of(task, work, at), a = traced->factor;
        weigh(task, at, s, jump);
        s.active &= largest_component(a) > 0.0f;
        if (!any(s.active)) continue;
        record_contribution(task, at, s.active, jump, a, abs(s.weight) * sqrt(dot(s.normal, s.normal)));
        Backward mode{scene, gradient, a};
        Curves::blocks(mode, scene, gradient, *traced, jump);
    }
}

static void add_splats_kernel(const CameraView& camera, const Splats& splats, int64_t count, float* image) {
    for (int64_t at = 0; at < count; at += W) {
        Float x, y;
        Vec3 value;
        Mask active = first_lanes(static_cast<int>(count - at < W ? count - at : W));
        for (int i = 0; i < W; ++i) {
            const int64_t k = active[i] ? at + i : at;
            x[i] = splats.x[k], y[i] = splats.y[k];
            value.x[i] = splats.value[0][k], value.y[i] = splats.value[1][k], value.z[i] = splats.value[2][k];
        }
        active &= x > kNowhere;
        if (any(active)) add_at(camera, active, x, y, value, image);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
