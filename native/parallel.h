// Work on all cores with progress and cancelling.
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>

namespace edgegrad {

// Called from the calling thread now and then with the fraction done; cancels by throwing.
using Progress = std::function<void(double)>;

// Thrown in calls of threads that the end of the process cuts short.
struct CallEnded : std::runtime_error {
    CallEnded() : std::runtime_error("the process ends") {}
};

// Ends all work of other threads than the calling one, for good: their calls throw `CallEnded`.
void end_work_of_others();
// Number of worker threads that run.
int worker_count();
// In a forked process, which has none.
void forget_workers();
// Whether the calling thread's work has been ended.
bool work_has_ended();

// What a call's own thread does now and then while it works, with or without a Progress: it looks for
// reasons to cancel and throws them. One at a time on a thread; a later one replaces it until its end.
class Interruption {
 public:
    explicit Interruption(std::function<void()> look);
    ~Interruption();
    Interruption(const Interruption&) = delete;
    Interruption& operator=(const Interruption&) = delete;

 private:
    friend void check_interruption();
    std::function<void()> look_;
    Interruption* outer_;
    int64_t next_;  // nanoseconds of the clock
};

// Looks for reasons to cancel if the last look is a while ago. For loops that take long and that no
// parallel_for runs; on other threads than a call's own it does nothing.
void check_interruption();

// Whether the parallel_for in which the calling thread works is being cancelled. Items that take long ask
// between their parts and leave the rest out.
bool work_is_cancelled();

// Number of threads to use for `asked` (0: all cores).
int thread_count(int asked);

// Runs body(thread, item) for every item in [0, items) on `threads` threads, item by item as they get free.
// Without progress the caller's is one of them: starting two threads takes twice as long as starting one, and
// small items take no longer. Rethrows the first exception of a body, of `progress` or of an interruption,
// after all threads have stopped; the items not yet begun are then left out.
void parallel_for(int threads, int64_t items, const Progress& progress,
                  const std::function<void(int thread, int64_t item)>& body);

}  // namespace edgegrad
