// Scratch memory of one thread, allocated by the thread that uses it first.
#pragma once

#include <type_traits>
#include <vector>

#include "kernels.h"

namespace edgegrad {

class ThreadWorkspace {
 public:
    Workspace& view() {
        if (memory_.empty()) {
            // Compacting writes whole packets behind the end.
            constexpr size_t row = kBlockPaths + 2 * kMaxWidth;
            constexpr size_t rows = 3 + 16 + 4 + 6 + 2 + 1;
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
            // Derivatives follow no path beyond the first hit: they share that memory.
            w.path = w.paths.path, w.face = w.hits.face, w.b1 = w.hits.b1, w.b2 = w.hits.b2;
            take(w.screen_x), take(w.screen_y), take(w.visible);
        }
        return view_;
    }

 private:
    std::vector<float> memory_;
    Workspace view_{};
};

}  // namespace edgegrad
