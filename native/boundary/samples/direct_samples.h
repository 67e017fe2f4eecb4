// Forward and reverse mode of boundary samples. add_to_picture and add_to_gradient take samples whose
// radiance is known. For its sample type a term defines moving_blocks(mode, scene, requested, samples), the
// velocities times the color; weigh(task, at, samples), which drops samples of infinite size; and
// sweep_of(samples), the swept area per unit of motion.
//
// direct_forward and direct_backward are the kernels of terms whose samples need no further paths. Such a
// term defines sample(scene, task, at, segment, requested, adjoint), which returns a packet of samples.
// `adjoint` is the adjoint of the picture: samples whose pixel has adjoint zero may be skipped. It is null in
// forward mode.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "film/splat.h"
#include "path/sample_blocks.h"
#include "tasks/boundary_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Lanes whose place in the picture has a nonzero adjoint.
EG_INLINE Mask has_adjoint(const SceneView& scene, Mask active, Float x, Float y, const float* adjoint) {
    if (!adjoint) return splat(-1);
    return largest_component(adjoint_at(scene.camera, active, x, y, adjoint)) > 0.0f;
}

template <typename Samples>
EG_INLINE void add_to_picture(const SceneView& scene, const BoundaryTask& task, int64_t at,
                              const DerivativeView& tangent, Samples& s, Splats& splats) {
    weigh(task, at, s);
    Forward mode{scene, tangent};
    if (any(s.active)) moving_blocks(mode, scene, tangent, s);
    write_splats(task, splats, at, s.active, s.view.sx, s.view.sy, mode.value);
}

template <typename Samples>
EG_INLINE void add_to_gradient(const SceneView& scene, const BoundaryTask& task, int64_t at,
                               const float* adjoint, Samples& s, DerivativeView& gradient) {
    weigh(task, at, s);
    if (!any(s.active)) return;
    const Vec3 a = adjoint_at(scene.camera, s.active, s.view.sx, s.view.sy, adjoint);
    record_contribution(task, at, s.active, s.color, a, sweep_of(s));
    Backward mode{scene, gradient, a};
    moving_blocks(mode, scene, gradient, s);
}

template <auto sample>
static void direct_forward(const SceneView& scene, const BoundaryTask& task, Workspace&,
                           const DerivativeView& tangent, Splats& splats) {
    SegmentCursor cursor = first_segment(task);
    for (int64_t at = 0; at < task.count; at += W) {
        auto s = sample(scene, task, at, cursor, tangent, nullptr);
        add_to_picture(scene, task, at, tangent, s, splats);
    }
}

template <auto sample>
static void direct_backward(const SceneView& scene, const BoundaryTask& task, Workspace&,
                            const float* adjoint, DerivativeView& gradient) {
    SegmentCursor cursor = first_segment(task);
    for (int64_t at = 0; at < task.count; at += W) {
        auto s = sample(scene, task, at, cursor, gradient, adjoint);
        add_to_gradient(scene, task, at, adjoint, s, gradient);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
