#include "parallel.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace edgegrad {
namespace {

using Clock = std::chrono::steady_clock;

// Between two questions to the caller.
constexpr std::chrono::milliseconds kAsking{50};

// Of this thread: what asks the caller, and when it last did; the flag of the loop whose body runs.
thread_local const std::function<void()>* ask_caller = nullptr;
thread_local Clock::time_point asked_at;
thread_local const std::atomic<bool>* stopping = nullptr;

}  // namespace

Cancelling::Cancelling(std::function<void()> ask)
    : ask_(std::move(ask)), outer_(std::exchange(ask_caller, &ask_)) {}
Cancelling::~Cancelling() { ask_caller = outer_; }

void may_cancel() {
    if (!ask_caller) return;
    const Clock::time_point now = Clock::now();
    if (now - asked_at < kAsking) return;
    asked_at = now;
    (*ask_caller)();
}

bool cancelled() {
    may_cancel();
    return stopping && *stopping;
}

int thread_count(int asked) {
    if (asked > 0) return asked;
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallel_for(int threads, int64_t items, const Progress& progress,
                  const std::function<void(int thread, int64_t item)>& body) {
    if (items <= 0) return;
    threads = static_cast<int>(std::min<int64_t>(threads, items));
    if (threads == 1 && !progress) {  // starting a thread takes longer than small items do
        for (int64_t item = 0; item < items; ++item) body(0, item), may_cancel();
        return;
    }
    std::atomic<int64_t> next{0}, done{0};
    std::atomic<bool> stop{false};
    std::mutex mutex;
    std::condition_variable finished;
    int running = 0;
    std::exception_ptr error;

    const auto work = [&](int thread) {
        const std::atomic<bool>* const outer = std::exchange(stopping, &stop);
        try {
            while (!stop) {
                const int64_t item = next++;
                if (item >= items) break;
                body(thread, item);
                ++done;
                may_cancel();
            }
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (!error) error = std::current_exception();
            stop = true;
        }
        stopping = outer;
        const std::lock_guard lock(mutex);
        --running;
        finished.notify_all();
    };

    std::vector<std::thread> pool;
    const auto join = [&] {
        for (std::thread& t : pool) t.join();
        pool.clear();
    };
    // The calling thread reports: only it may talk to the caller. Else it works.
    const int started = progress ? threads : threads - 1;
    try {
        pool.reserve(static_cast<size_t>(started));
        running = threads;
        for (int t = 0; t < started; ++t) {
            try {
                pool.emplace_back(work, t);
            } catch (...) {  // the system has no more threads: those that run do the work
                const std::lock_guard lock(mutex);
                running -= started - t;
                if (progress && pool.empty()) throw;
                break;
            }
        }
        if (!progress) work(started);
        std::unique_lock lock(mutex);
        while (!finished.wait_for(lock, kAsking, [&] { return running == 0; })) {
            lock.unlock();
            if (progress)
                progress(static_cast<double>(done) / static_cast<double>(items));
            else
                may_cancel();
            lock.lock();
        }
    } catch (...) {
        stop = true;
        join();
        throw;
    }
    join();
    if (error) std::rethrow_exception(error);
    if (progress) progress(1.0);
}

}  // namespace edgegrad
