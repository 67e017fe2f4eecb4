// How native code releases and reacquires the interpreter: its lock, signals, and the end of the process.
//
// When a foreign thread reacquires the interpreter after Python has ended, Python unwinds the thread's stack
// (up to 3.13) or stops the thread (from 3.14). Unwinding through a function that may not throw would abort
// the process. Therefore `end_calls` runs at exit, before Python ends: it cancels the calls of all other
// threads and waits until they have left native code. A thread that is nevertheless too late stops where it
// is.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>

#include "util/parallel.h"

namespace edgegrad {

// While an instance exists, the calling thread works without the interpreter's lock and handles signals
// (util/parallel.h: may_cancel).
class WithoutInterpreter {
 public:
    WithoutInterpreter();
    ~WithoutInterpreter();
    WithoutInterpreter(const WithoutInterpreter&) = delete;
    WithoutInterpreter& operator=(const WithoutInterpreter&) = delete;

 private:
    friend void with_interpreter(const std::function<void()>& run);
    void leave();
    void come_back();

    PyThreadState* state_ = nullptr;
    WithoutInterpreter* outer_;
    Cancelling cancelling_;
};

// Runs a function so, and returns its result.
template <typename Run>
auto without_interpreter(const Run& run) {
    const WithoutInterpreter without;
    return run();
}

// Calls a Python function from time to time, or nothing if it is None. Its exceptions, signals and the end of
// the process cancel the work.
Progress make_progress(nanobind::object callback);

// Binds the functions that core/rendering/native_engine.py registers for exit and forks of the process.
void bind_process(nanobind::module_& module);

}  // namespace edgegrad
