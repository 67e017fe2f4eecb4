#include "python/call.h"

#include <atomic>
#include <chrono>
#include <exception>
#include <thread>
#include <utility>

namespace nb = nanobind;

namespace edgegrad {
namespace {

std::atomic<int> calls{0};    // that have released the interpreter
std::atomic<int> outside{0};  // of these, the calls that are not in a progress function
thread_local constinit WithoutInterpreter* call_of_thread EDGEGRAD_STATIC_THREAD_LOCAL = nullptr;

[[noreturn]] void stop_for_ever() {
    for (;;) std::this_thread::sleep_for(std::chrono::hours(24));
}

// Runs before everything else at a process's exit (see call.h).
void end_calls() {
    end_work_of_others();
    PyThreadState* const state = PyEval_SaveThread();
    // Progress functions that do not return cannot be ended, but no thread works for them any more.
    while (outside > 0 || worker_count() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    PyEval_RestoreThread(state);
    if (calls > 0) nb::set_leak_warnings(false);  // unfinished calls keep their objects alive
}

// Runs in a forked process, which has no other threads.
void forget_calls() {
    outside = 0;  // the forking thread's own call is in its progress function
    forget_workers();
}

void check_not_ended() {
    if (work_has_ended()) throw CallEnded();
}

void look_for_signals() {
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

}  // namespace

// Runs a function that may call Python, from within a call that has released the interpreter.
void with_interpreter(const std::function<void()>& run);

WithoutInterpreter::WithoutInterpreter()
    : outer_((check_not_ended(), std::exchange(call_of_thread, this))),
      cancelling_([] { with_interpreter(look_for_signals); }) {
    ++calls;
    leave();
}

WithoutInterpreter::~WithoutInterpreter() {
    come_back();
    call_of_thread = outer_;
    --calls;
}

void WithoutInterpreter::leave() {
    ++outside;
    state_ = PyEval_SaveThread();
}

void WithoutInterpreter::come_back() {
    try {
        PyEval_RestoreThread(state_);
    } catch (...) {  // Python unwinds the stack of a thread that it ends
        stop_for_ever();
    }
    --outside;
}

void with_interpreter(const std::function<void()>& run) {
    check_not_ended();
    WithoutInterpreter* const call = call_of_thread;
    call->come_back();
    try {
        run();
    } catch (const std::exception&) {
        call->leave();
        throw;
    } catch (...) {
        stop_for_ever();
    }
    call->leave();
}

Progress make_progress(nb::object callback) {
    return [callback = std::move(callback)](double fraction) {
        with_interpreter([&] {
            look_for_signals();
            if (callback.is_none()) return;
            // Uses the C interface, because the unwinding may not pass through nanobind's calls.
            PyObject* const argument = PyFloat_FromDouble(fraction);
            PyObject* const result =
                argument ? PyObject_CallFunctionObjArgs(callback.ptr(), argument, nullptr) : nullptr;
            Py_XDECREF(argument);
            if (!result) throw nb::python_error();
            Py_DECREF(result);
        });
    };
}

void bind_process(nb::module_& m) {
    nb::register_exception_translator([](const std::exception_ptr& error, void*) {
        try {
            std::rethrow_exception(error);
        } catch (const CallEnded&) {
            PyErr_SetNone(PyExc_SystemExit);  // ends a thread silently
        }
    });
    m.def("end_calls", &end_calls, "Cancels the calls of all other threads and waits for their end.");
    m.def("forget_calls", &forget_calls,
          "Forgets the calls of other threads in a forked process, which has none.");
}

}  // namespace edgegrad
