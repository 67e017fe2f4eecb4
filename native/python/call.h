// How native code leaves the interpreter and comes back: its lock, signals, the end of the process.
//
// Python ends foreign threads that come back after its own end by unwinding their stack (up to 3.13), or
// stops them for ever (from 3.14). Unwinding must not meet a function that may not throw: that would abort
// the process. So at exit, before Python's end begins, `end_calls` cancels the calls of all other threads and
// waits until they have left native code, and a thread that comes back too late nonetheless stops where it
// is.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>

#include "util/parallel.h"

namespace edgegrad {

// While one exists, the calling thread works without the interpreter's lock, and answers signals
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

// Calls a Python function, or nothing if it is None, now and then; cancels by its exceptions, by signals and
// by the end of the process.
Progress make_progress(nanobind::object callback);

// The functions that core/rendering/native_engine.py registers for the process's exit and forks.
void bind_process(nanobind::module_& module);

}  // namespace edgegrad
