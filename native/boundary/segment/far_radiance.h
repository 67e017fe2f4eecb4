// The far end of an indirect boundary segment: the surface y behind the edge, and the radiance from y towards
// the edge, which the path tracer of pictures estimates.
#pragma once

#include "boundary/samples/direct_samples.h"
#include "boundary/samples/visible_edge.h"
#include "boundary/segment/light_source.h"
#include "boundary/segment/segment.h"
#include "path/start.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// A task's samples as paths of the path tracer.
EG_INLINE ImageTask light_paths(const BoundaryTask& task, int sides = 1) {
    return sample_paths(task, sides, hash(task.seed ^ 0x7f4a7c15u));
}

// Where y is closer to the edge than rounding, the edge lies in y's surface (derivations, F3). Rays then
// leave y from a point slightly beside the edge, on the side that the edge's faces do not occlude.
EG_INLINE Vec3 leave_contact(const SceneView& scene, Mask touched, Vec3 t, Vec3 hidden_side,
                             const Closest& y) {
    Triangle triangle = placed_triangle(scene, y.face, y.instance).triangle;
    Float b1 = y.b1, b2 = y.b2;
    settle_on_fields(scene, touched, y.face, triangle, b1, b2);
    Vec3 across = cross(area_normal(triangle), t);
    across = across * (aside(triangle) / max(sqrt(dot(across, across)), 1e-30f));
    return select(touched, select(dot(across, hidden_side) > 0.0f, -across, across), zero3());
}

// Finds the surface behind the edge.
[[maybe_unused]] EG_OUTLINE LightSource find_source(const SceneView& scene, const BoundaryTask& task,
                                                    const BoundarySegment& s, Mask active, Int path, Vec3 t,
                                                    Vec3 w) {
    // The ray starts in front of the edge, so that a surface that touches the edge is not missed.
    const Float rounding = 1e-5f * largest_component(s.point);
    LightSource y = meet_source(scene, active, s.point + w * rounding, -w, {s.edge, s.instance},
                                path_index(light_paths(task), path), task.limits.transparent);
    const Mask touched = y.hit.hit & (y.hit.distance < 2.0f * rounding);
    y.distance = select(y.hit.hit, max(y.hit.distance - rounding, 0.0f), 0.0f);
    if (any(touched)) y.aside = leave_contact(scene, touched, t, s.sweep, y.hit);
    return y;
}

// Samples the segments of an estimator without L(y), then traces the paths of all L(y) together.
template <auto sample, typename Segment, int kSides>
EG_INLINE Segment* trace_segments(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                  const DerivativeView& requested) {
    const int count = static_cast<int>(task.count);
    const size_t packets = static_cast<size_t>((count + W - 1) / W);
    auto* segments = static_cast<Segment*>(work.segments->grow(packets * sizeof(Segment), 0));
    SegmentCursor cursor = first_segment(task);
    int queued = 0;
    for (int at = 0; at < count; at += W)
        queued = sample(scene, task, requested, at, cursor, work, queued, segments[at / W]);
    // The radiance of lights is known
    if (task.kind == kLightIntersection || task.kind == kCrossedLight) return segments;
    run_appended(scene, light_paths(task, kSides), work, queued, kSides * count);
    for (int at = 0; at < count; at += W) {
        BoundarySegment& s = segments[at / W];
        Vec3 light;
        load3(light, work.radiance, at);
        if constexpr (kSides == 2) {
            Vec3 other;
            load3(other, work.radiance, count + at);
            light = light - other;
        }
        s.color = s.color * light;
        s.active &= ~((kSides == 2 ? size_of(s.color) : largest_component(s.color)) <= 0.0f);
    }
    return segments;
}

// Forward and reverse mode of such an estimator. sample(scene, task, requested, at, segment, work, queued, s)
// sets a packet `s` of segments without L(y). It appends their paths to the queue of length `queued` and
// returns the new length. With two sides there are `count` more paths, whose radiance is subtracted.
template <auto sample, typename Segment = BoundarySegment, int kSides = 1>
static void lit_segments_forward(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                 const DerivativeView& tangent, Splats& splats) {
    Segment* segments = trace_segments<sample, Segment, kSides>(scene, task, work, tangent);
    for (int at = 0; at < static_cast<int>(task.count); at += W)
        add_to_picture(scene, task, at, tangent, segments[at / W], splats);
}

template <auto sample, typename Segment = BoundarySegment, int kSides = 1>
static void lit_segments_backward(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                  const float* adjoint, DerivativeView& gradient) {
    Segment* segments = trace_segments<sample, Segment, kSides>(scene, task, work, gradient);
    for (int at = 0; at < static_cast<int>(task.count); at += W)
        add_to_gradient(scene, task, at, adjoint, segments[at / W], gradient);
}

}  // namespace edgegrad::EDGEGRAD_ISA
