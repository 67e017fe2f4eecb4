// Loops over all cores, with progress and cancellation.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>

// For thread-local variables. Without it a thread's first access may allocate memory, and a failure would end
// the process.
#if defined(__GNUC__) && !defined(_WIN32)
#define EDGEGRAD_STATIC_THREAD_LOCAL __attribute__((tls_model("initial-exec")))
#else
#define EDGEGRAD_STATIC_THREAD_LOCAL
#endif

namespace edgegrad {

// Called from the calling thread from time to time with the completed fraction. Throws to cancel.
using Progress = std::function<void(double)>;

// Thrown by calls of other threads when the process ends.
struct CallEnded : std::runtime_error {
    CallEnded() : std::runtime_error("the process ends") {}
};

// Ends all work of threads other than the calling one, permanently: their calls throw `CallEnded`.
void end_work_of_others();
// Number of running worker threads.
int worker_count();
// To call in a forked process, which has no worker threads.
void forget_workers();
// Returns whether the calling thread's work has been ended.
bool work_has_ended();

// Number of threads to use for a requested number (0: all cores).
int thread_count(int requested);

// Runs body(thread, item) for every item in [0, items) on `threads` threads, each of which takes the next
// item when it is free. Without `progress` the calling thread is one of them, because small items take no
// longer than starting a thread. Rethrows the first exception of a body, of `progress` or of an interruption
// after all threads have stopped. Items that have not begun are then skipped.
void parallel_for(int threads, int64_t items, const Progress& progress,
                  const std::function<void(int thread, int64_t item)>& body);

// Runs body(block, first, last) for blocks of `size` consecutive items, of which the last one may be smaller.
template <typename Body>
void parallel_blocks(int threads, std::size_t items, std::size_t size, const Body& body) {
    const auto blocks = static_cast<int64_t>((items + size - 1) / size);
    parallel_for(threads, blocks, nullptr, [&](int, int64_t block) {
        const std::size_t first = static_cast<std::size_t>(block) * size;
        body(static_cast<std::size_t>(block), first, std::min(items, first + size));
    });
}

// Runs body(item) for every item, in blocks that are large enough for a body of a few instructions.
template <typename Body>
void parallel_each(int threads, std::size_t items, const Body& body) {
    parallel_blocks(threads, items, 2048, [&](std::size_t, std::size_t first, std::size_t last) {
        for (std::size_t k = first; k < last; ++k) body(k);
    });
}

// While it lives, `ask` is called to ask the caller whether this thread's work may continue: in loops without
// `progress`, and in serial work that calls `may_cancel`. It throws to cancel.
class Cancelling {
 public:
    explicit Cancelling(std::function<void()> ask);
    ~Cancelling();
    Cancelling(const Cancelling&) = delete;
    Cancelling& operator=(const Cancelling&) = delete;

 private:
    std::function<void()> ask_;
    const std::function<void()>* outer_;  // of an enclosing call
};

// To call between parts of serial work: asks the caller, but at most as often as loops do.
void may_cancel();

// To call between parts of a long body: returns whether its loop is being cancelled. The body should then
// return; its results are not used because the loop throws. Asks the caller if the body runs on the caller's
// thread.
bool cancelled();

}  // namespace edgegrad
