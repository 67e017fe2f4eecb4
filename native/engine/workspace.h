// Scratch memory of one thread, allocated by the thread that uses it first.
#pragma once

#include <type_traits>
#include <vector>

#include "tasks/adjoint_task.h"
#include "tasks/block_sizes.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad {

// What a thread's sweeps over recorded paths need.
class AdjointWorkspace {
 public:
    // The workspace with vertices recorded, and a task for sweeps over them but for its tables.
    AdjointTask task(const ImageTask& image, Workspace& work) {
        if (memory_.empty()) {
            constexpr size_t row = kBlockPaths + 2 * kMaxWidth;
            memory_.resize(14 * row);
            float* next = memory_.data();
            const auto take = [&](auto*& p) {
                p = reinterpret_cast<std::remove_reference_t<decltype(p)>>(next);
                next += row;
            };
            take(camera_.x), take(camera_.y), take(camera_.lens_u), take(camera_.lens_v);
            for (auto* v : {&task_.incoming, &task_.position, &task_.direction})
                for (float*& p : *v) take(p);
            take(task_.next);
        }
        work.vertices = &vertices_;
        // What an earlier call asked for is none of this one's business.
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
    // Paths are followed without being recorded again.
    static void release(Workspace& work) {
        work.vertices = nullptr;
        work.values = nullptr;
    }

 private:
    std::vector<float> memory_;
    VertexMemory vertices_;
    ValueMemory values_;
    TapeMemory tape_;
    CameraSamples camera_{};
    AdjointTask task_{};
};

// Crossings of scan lines (boundary/specular/scan_lines.h), at most one for each segment of a task.
class ChainWorkspace {
 public:
    ChainCrossings& view(const CameraSamples& camera) {
        if (memory_.empty()) {
            constexpr size_t row = kBlockPaths / 2 + 2 * kMaxWidth;
            memory_.resize((10 * kMostChain + 40) * row);
            float* next = memory_.data();
            const auto take = [&](auto*& p) {
                p = reinterpret_cast<std::remove_reference_t<decltype(p)>>(next);
                next += row;
            };
            ChainCrossings& c = view_;
            take(c.segment), take(c.horizontal), take(c.length), take(c.parted);
            for (auto* v : {&c.face, &c.mesh, &c.instance, &c.closure, &c.event})
                for (int32_t*& p : *v) take(p);
            for (auto* v : {&c.b1, &c.b2, &c.half[0], &c.half[1], &c.half[2]})
                for (float*& p : *v) take(p);
            take(c.edge), take(c.edge_instance), take(c.u), take(c.weight), take(c.seen);
            for (auto* v : {&c.from, &c.jump, &c.by_point, &c.by_direction, &c.direction})
                for (float*& p : *v) take(p);
            for (float*& p : c.by_screen) take(p);
            for (float*& p : c.light_place) take(p);
            take(c.lit), take(c.light_row), take(c.light_kind), take(c.light_face), take(c.light_blockers);
            take(c.light_instance), take(c.light_scatters);
            take(c.light_visible_to), take(c.light_b1), take(c.light_b2), take(c.light_density);
        }
        view_.x = camera.x, view_.y = camera.y, view_.lens_u = camera.lens_u, view_.lens_v = camera.lens_v;
        return view_;
    }

 private:
    std::vector<float> memory_;
    ChainCrossings view_{};
};

class ThreadWorkspace {
 public:
    Workspace& view() {
        if (memory_.empty()) {
            // Compacting writes whole packets behind the end.
            constexpr size_t row = kBlockPaths + 2 * kMaxWidth;
            constexpr size_t rows = 3 + 16 + 4 + 6 + 1 + 6;
            memory_.resize(rows * row);
            float* next = memory_.data();
            const auto take = [&](auto*& p) {
                p = reinterpret_cast<std::remove_reference_t<decltype(p)>>(next);
                next += row;
            };
            Workspace& w = view_;
            for (float*& p : w.radiance) take(p);
            for (auto* v : {&w.paths.origin, &w.paths.direction, &w.paths.throughput, &w.paths.from,
                            &w.paths.from_normal})
                for (float*& p : *v) take(p);
            take(w.paths.pdf), take(w.paths.path), take(w.paths.state), take(w.paths.bounces);
            take(w.paths.from_mesh);
            take(w.hits.face), take(w.hits.mesh), take(w.hits.instance);
            take(w.hits.b1), take(w.hits.b2), take(w.hits.distance);
            take(w.visible);
            for (float*& p : w.edges.aside) take(p);
            take(w.edges.other), take(w.edges.b1), take(w.edges.b2);
            w.segments = &segments_;
        }
        return view_;
    }

 private:
    std::vector<float> memory_;
    TapeBuffer segments_;
    Workspace view_{};
};

// What one thread of a call computes in.
class ThreadMemory {
 public:
    Workspace& paths() { return paths_.view(); }

    AdjointWorkspace adjoint;
    ChainWorkspace chains;

 private:
    ThreadWorkspace paths_;
};

}  // namespace edgegrad
