#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <memory>
#include <utility>

namespace oaslam::python {

// Releases Python's lock while it exists, as pybind11's gil_scoped_release does, but is safe on a
// daemon thread that still works when the interpreter ends. Python before 3.14 then unwinds the
// thread's stack, which aborts the program where a destructor is on it. Here the thread blocks
// until the program has ended, as in Python 3.14.
class WithoutPythonsLock {
 public:
  WithoutPythonsLock() : state_(PyEval_SaveThread()) {}
  ~WithoutPythonsLock() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) {
      while (true) pause();
    }
  }
  WithoutPythonsLock(const WithoutPythonsLock&) = delete;
  WithoutPythonsLock& operator=(const WithoutPythonsLock&) = delete;

 private:
  PyThreadState* state_;
};

using WithoutGil = pybind11::call_guard<WithoutPythonsLock>;

// While it exists, a thread of the library may call Python; EndPythonCalls waits for its end.
class PythonCall {
 public:
  PythonCall();
  ~PythonCall();
  PythonCall(const PythonCall&) = delete;
  PythonCall& operator=(const PythonCall&) = delete;
  // False once the interpreter is ending.
  bool is_allowed() const { return is_allowed_; }

 private:
  const bool is_allowed_;
};

// Waits for the calls under way, and forbids later ones. Called at the end of the interpreter,
// without Python's lock.
void EndPythonCalls();

// Calls a function with Python's lock, on any thread, unless the interpreter is ending. The
// library's locks are not held meanwhile.
template <typename Function>
void CallPython(Function&& function) {
  const PythonCall call;
  if (!call.is_allowed()) return;
  const pybind11::gil_scoped_acquire gil;
  function();
}

// A Python callable that may be deleted on any thread; leaked where the interpreter has ended.
template <typename Callable>
std::shared_ptr<Callable> KeptFromPython(Callable callable) {
  return {new Callable(std::move(callable)), [](Callable* c) { CallPython([c] { delete c; }); }};
}

}  // namespace oaslam::python
