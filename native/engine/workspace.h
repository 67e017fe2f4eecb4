// Scratch memory of one thread, allocated by the thread that uses it first.
#pragma once

#include "tasks/adjoint_task.h"
#include "tasks/block_sizes.h"
#include "tasks/image_task.h"
#include "tasks/scan_task.h"
#include "tasks/workspace_view.h"
#include "util/scratch_block.h"

namespace edgegrad {

// Elements of an array by path. Compaction writes whole packets behind the last path.
constexpr size_t kPathRow = kBlockPaths + 2 * kMaxWidth;

// Memory of one thread for sweeps over recorded paths.
class AdjointWorkspace {
 public:
    // Makes the workspace record vertices, and returns a task for sweeps over them, without its tables.
    AdjointTask task(const ImageTask& image, Workspace& work) {
        if (block_.empty())
            block_.lay_out([&](const auto& take) {
                take(kPathRow, camera_.x, camera_.y, camera_.lens_u, camera_.lens_v, task_.incoming,
                     task_.position, task_.direction, task_.next);
            });
        work.vertices = &vertices_;
        // Remove the requests of an earlier call
        vertices_.geometry = vertices_.misses = true;
        vertices_.requested = {};
        vertices_.rims = false;
        vertices_.passed.closures = nullptr;
        work.camera = camera_;
        task_.image = &image;
        task_.vertices = &vertices_;
        task_.camera = camera_;
        task_.tape = &tape_;
        return task_;
    }
    // The same for derivatives by colours and strengths.
    ValueTask value_task(const ImageTask& image, Workspace& work) {
        const AdjointTask all = task(image, work);
        work.vertices = nullptr;
        work.values = &values_;
        return {&image, &values_, nullptr, nullptr, {all.incoming[0], all.incoming[1], all.incoming[2]}};
    }
    // Stops recording.
    static void release(Workspace& work) {
        work.vertices = nullptr;
        work.values = nullptr;
    }
    void check() const { block_.check(); }

 private:
    ScratchBlock block_;
    VertexMemory vertices_;
    ValueMemory values_;
    TapeMemory tape_;
    CameraSamples camera_{};
    AdjointTask task_{};
};

// Memory for intersections of scan lines (boundary/specular/scan_lines.h), at most one per segment of a task.
class ChainWorkspace {
 public:
    ChainCrossings& view(const CameraSamples& camera) {
        ChainCrossings& c = view_;
        if (block_.empty())
            block_.lay_out([&](const auto& take) {
                take(kBlockPaths / 2 + 2 * kMaxWidth, c.segment, c.horizontal, c.length, c.parted, c.face,
                     c.mesh, c.instance, c.closure, c.event, c.b1, c.b2, c.half, c.edge, c.edge_instance, c.u,
                     c.field, c.crossed_face, c.crossed_instance, c.outlined_light, c.curve_point,
                     c.outline_normal, c.contact, c.weight, c.from, c.seen, c.jump, c.by_point,
                     c.by_direction, c.direction, c.by_screen, c.lit, c.light_row, c.light_kind, c.light_face,
                     c.light_instance, c.light_scatters, c.light_blockers, c.light_visible_to, c.light_b1,
                     c.light_b2, c.light_place, c.light_density);
            });
        c.x = camera.x, c.y = camera.y, c.lens_u = camera.lens_u, c.lens_v = camera.lens_v;
        return c;
    }
    void check() const { block_.check(); }

 private:
    ScratchBlock block_;
    ChainCrossings view_{};
};

// Memory of one thread of a call.
class ThreadMemory {
 public:
    Workspace& paths() {
        Workspace& w = view_;
        if (block_.empty()) {
            PathQueue& q = w.paths;
            HitQueue& h = w.hits;
            block_.lay_out([&](const auto& take) {
                take(kPathRow, w.radiance, q.origin, q.direction, q.throughput, q.from, q.from_normal,
                     q.from_receiving, q.pdf, q.lobe_alpha, q.lobe_slope2, q.path, q.state, q.bounces,
                     q.from_mesh, h.face, h.mesh, h.instance, h.b1, h.b2, h.distance, w.visible,
                     w.edges.aside, w.edges.other, w.edges.b1, w.edges.b2);
            });
            w.segments = &segments_;
        }
        return w;
    }
    // In debug builds, checks that the last task has not written beyond its arrays.
    void check() const {
        if constexpr (ScratchBlock::kGuard > 0) block_.check(), adjoint.check(), chains.check();
    }

    AdjointWorkspace adjoint;
    ChainWorkspace chains;

 private:
    ScratchBlock block_;
    TapeBuffer segments_;
    Workspace view_{};
};

}  // namespace edgegrad
