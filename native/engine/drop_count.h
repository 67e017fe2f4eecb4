// Samples of a picture, or of a term of a derivative, that all threads together leave out.
#pragma once

#include <mutex>

#include "tasks/dropped_samples.h"

namespace edgegrad {

class DropCount {
 public:
    // `before`: number of samples of earlier passes. The first sample of all threads is kept.
    void add(const DroppedSamples& more, int64_t before = 0) {
        if (more.count == 0) return;
        const std::lock_guard lock(lock_);
        const int64_t count = sum_.count + more.count;
        if (before + more.first < sum_.first) {
            sum_ = more;
            sum_.first += before;
        }
        sum_.count = count;
    }
    const DroppedSamples& sum() const { return sum_; }

 private:
    std::mutex lock_;
    DroppedSamples sum_;
};

}  // namespace edgegrad
