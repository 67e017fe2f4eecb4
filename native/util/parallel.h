// Work on all cores with progress and cancelling.
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>

// For thread-local variables: without it a thread's first use of one may allocate memory, and end the process
// where there is none.
#if defined(__GNUC__) && !defined(_WIN32)
#define EDGEGRAD_STATIC_THREAD_LOCAL __attribute__((tls_model("initial-exec")))
#else
#define EDGEGRAD_STATIC_THREAD_LOCAL
#endif

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

// Number of threads to use for `asked` (0: all cores).
int thread_count(int requested);

// Runs body(thread, item) for every item in [0, items) on `threads` threads, item by item as they get free.
// Without progress the caller's is one of them: starting two threads takes twice as long as starting one, and
// small items take no longer. Rethrows the first exception of a body, of `progress` or of an interruption,
// after all threads have stopped; the items not yet begun are then left out.
void parallel_for(int threads, int64_t items, const Progress& progress,
                  const std::function<void(int thread, int64_t item)>& body);

// What asks the caller, while it lives, whether the work of this thread is to go on, where no progress is
// told: in loops without a progress of their own, and in serial work that calls `may_cancel`. It cancels by
// throwing.
class Cancelling {
 public:
    explicit Cancelling(std::function<void()> ask);
    ~Cancelling();
    Cancelling(const Cancelling&) = delete;
    Cancelling& operator=(const Cancelling&) = delete;

 private:
    std::function<void()> ask_;
    const std::function<void()>* outer_;  // of a call inside of which this one is made
};

// Between parts of serial work: asks, but not more often than loops do.
void may_cancel();

// Between parts of a body that takes long: whether its loop is being cancelled. The body then returns; what
// it has left behind is not used, since the loop throws. Asks where the body runs on the caller's thread.
bool cancelled();

}  // namespace edgegrad
