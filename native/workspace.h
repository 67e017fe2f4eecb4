// Scratch memory of one thread, allocated by the thread that uses it first.
#pragma once

#include <vector>

#include "kernels.h"

namespace edgegrad {

class ThreadWorkspace {
 public:
    Workspace& view() {
        if (memory_.empty()) {
            // Compacting writes whole packets behind the end.
            constexpr size_t row = kBlockPaths + 2 * kMaxWidth;
            memory_.resize(9 * row);
            float* p = memory_.data();
            view_ = {{p, p + row, p + 2 * row},
                     reinterpret_cast<int32_t*>(p + 3 * row),
                     reinterpret_cast<int32_t*>(p + 4 * row),
                     p + 5 * row,
                     p + 6 * row,
                     p + 7 * row,
                     p + 8 * row};
        }
        return view_;
    }

 private:
    std::vector<float> memory_;
    Workspace view_{};
};

}  // namespace edgegrad
