// Both modes of boundary samples that need no paths, since what they are seen by and what jumps there is
// known. sample(scene, task, at, piece, asked) gives a packet of them, weigh(task, at, samples) leaves out
// those without a finite size, and moving_blocks(mode, scene, asked, samples) is what moves, times their
// color.
#pragma once

#include "boundary/pieces.h"
#include "film/splat.h"
#include "path/blocks.h"

namespace edgegrad::EDGEGRAD_ISA {

template <auto sample>
static void direct_forward(const SceneView& scene, const BoundaryTask& task, Workspace&,
                           const DerivativeView& tangent, Splats& splats) {
    PieceCursor piece = first_piece(task);
    for (int64_t at = 0; at < task.count; at += W) {
        auto s = sample(scene, task, at, piece, tangent);
        weigh(task, at, s);
        Forward mode{scene, tangent};
        if (any(s.active)) moving_blocks(mode, scene, tangent, s);
        write_splats(task, splats, at, s.active, s.view.sx, s.view.sy, mode.value);
    }
}

template <auto sample>
static void direct_backward(const SceneView& scene, const BoundaryTask& task, Workspace&,
                            const float* adjoint, DerivativeView& gradient) {
    PieceCursor piece = first_piece(task);
    for (int64_t at = 0; at < task.count; at += W) {
        auto s = sample(scene, task, at, piece, gradient);
        weigh(task, at, s);
        if (!any(s.active)) continue;
        Backward mode{scene, gradient, adjoint_at(scene.camera, s.active, s.view.sx, s.view.sy, adjoint)};
        moving_blocks(mode, scene, gradient, s);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
