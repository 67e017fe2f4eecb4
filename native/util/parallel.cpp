#include "util/parallel.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#ifndef _WIN32
#include <unistd.h>
#endif

namespace edgegrad {
namespace {

using Clock = std::chrono::steady_clock;

// Time between two questions to the caller: how late calls are cancelled, against how often they take
// Python's lock.
constexpr std::chrono::milliseconds kAsking{10};

std::atomic<bool> others_end{false};
std::atomic<std::thread::id> last_thread;  // the thread whose work continues
std::atomic<int> workers{0};

bool is_ended(std::thread::id caller) { return others_end && last_thread.load() != caller; }

// The parallel_for in which a thread works.
struct Work {
    std::thread::id caller;
    std::atomic<bool> stop{false};
    bool cancelled() const { return stop || is_ended(caller); }
};

// Per thread: the function that asks the caller, when it was last called, and the running loop.
thread_local constinit const std::function<void()>* ask_caller EDGEGRAD_STATIC_THREAD_LOCAL = nullptr;
thread_local constinit Clock::time_point requested_at EDGEGRAD_STATIC_THREAD_LOCAL{};
thread_local constinit const Work* work_of_thread EDGEGRAD_STATIC_THREAD_LOCAL = nullptr;

int64_t process_id() {
#ifdef _WIN32
    return 0;  // there is no fork
#else
    return getpid();
#endif
}

class Working {
 public:
    explicit Working(const Work& work) : outer_(std::exchange(work_of_thread, &work)) {}
    ~Working() { work_of_thread = outer_; }

 private:
    const Work* outer_;
};

}  // namespace

void end_work_of_others() {
    last_thread = std::this_thread::get_id();
    others_end = true;
}

int worker_count() { return workers; }
void forget_workers() { workers = 0; }
bool work_has_ended() { return is_ended(std::this_thread::get_id()); }

Cancelling::Cancelling(std::function<void()> ask)
    : ask_(std::move(ask)), outer_(std::exchange(ask_caller, &ask_)) {}
Cancelling::~Cancelling() { ask_caller = outer_; }

void may_cancel() {
    if (!ask_caller) return;
    const Clock::time_point now = Clock::now();
    if (now - requested_at < kAsking) return;
    requested_at = now;
    (*ask_caller)();
}

bool cancelled() {
    may_cancel();
    return work_of_thread && work_of_thread->cancelled();
}

int thread_count(int requested) {
    if (requested > 0) return requested;
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallel_for(int threads, int64_t items, const Progress& progress,
                  const std::function<void(int thread, int64_t item)>& body) {
    if (items <= 0) return;
    threads = static_cast<int>(std::min<int64_t>(threads, items));
    if (threads == 1 && !progress) {  // starting a thread takes longer than small items do
        for (int64_t item = 0; item < items; ++item) {
            body(0, item);
            may_cancel();
        }
        return;
    }
    Work shared{std::this_thread::get_id()};
    const int64_t process = process_id();
    std::atomic<int64_t> next{0}, done{0};
    std::mutex mutex;
    std::condition_variable finished;
    int running = 0;
    std::exception_ptr error;

    // Define the loop that each thread runs
    const auto work = [&](int thread) {
        try {
            const Working working(shared);
            while (!shared.stop) {
                if (is_ended(shared.caller)) throw CallEnded();
                const int64_t item = next++;
                if (item >= items) break;
                body(thread, item);
                ++done;
                may_cancel();
            }
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (!error) error = std::current_exception();
            shared.stop = true;
        }
        const std::lock_guard lock(mutex);
        --running;
        finished.notify_all();
    };
    const auto run = [&](int thread) {
        work(thread);
        --workers;
    };

    // Define how to wait for the threads
    std::vector<std::thread> pool;
    const auto join = [&] {
        // After a fork the threads exist only in the parent process, so the child cannot join them.
        if (process_id() != process)
            new std::vector<std::thread>(std::move(pool));
        else
            for (std::thread& t : pool) t.join();
        pool.clear();
    };
    // Start the threads. With `progress` the calling thread only reports, because only it may call the
    // caller.
    const int started = progress ? threads : threads - 1;
    try {
        pool.reserve(static_cast<size_t>(started));
        running = threads;
        for (int t = 0; t < started; ++t) {
            try {
                ++workers;
                pool.emplace_back(run, t);
            } catch (...) {  // if the system has no more threads, the running ones do the work
                --workers;
                const std::lock_guard lock(mutex);
                running -= started - t;
                if (progress && pool.empty()) throw;
                break;
            }
        }
        // Work or report progress until all threads are done
        if (!progress) work(started);
        std::unique_lock lock(mutex);
        while (!finished.wait_for(lock, kAsking, [&] { return running == 0; })) {
            lock.unlock();
            if (progress)
                progress(static_cast<double>(done) / static_cast<double>(items));
            else
                may_cancel();
            if (process_id() != process)
                throw std::runtime_error(
                    "this call can't go on in a process forked from its progress function; "
                    "its threads stayed in the other process");
            lock.lock();
        }
    } catch (...) {
        shared.stop = true;
        join();
        throw;
    }
    // Join the threads and rethrow the first exception
    join();
    if (error) std::rethrow_exception(error);
    if (progress) progress(1.0);
}

}  // namespace edgegrad
