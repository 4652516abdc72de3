#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <memory>
#include <utility>

namespace oaslam::python {

// Lets go of Python's lock while it exists, as pybind11's gil_scoped_release does, but ends well on
// a daemon thread that is still at work when the interpreter ends. Before 3.14, Python then ends
// the thread by unwinding its stack, which must not leave a destructor: here the thread stays where
// it is until the program has ended, as in Python 3.14.
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

// A time in which a thread of ours may call Python: EndPythonCalls waits for its end.
class PythonCall {
 public:
  PythonCall();
  ~PythonCall();
  PythonCall(const PythonCall&) = delete;
  PythonCall& operator=(const PythonCall&) = delete;
  // Not once the interpreter ends.
  bool is_allowed() const { return is_allowed_; }

 private:
  const bool is_allowed_;
};

// Waits for the calls under way; later ones are not allowed. For the end of the interpreter,
// without Python's lock.
void EndPythonCalls();

// Calls a function with Python's lock, on any thread, unless the interpreter ends. No lock of ours
// is held meanwhile.
template <typename Function>
void CallPython(Function&& function) {
  const PythonCall call;
  if (!call.is_allowed()) return;
  const pybind11::gil_scoped_acquire gil;
  function();
}

// A callable of Python that may be deleted on any thread; where the interpreter has ended it is
// not.
template <typename Callable>
std::shared_ptr<Callable> KeptFromPython(Callable callable) {
  return {new Callable(std::move(callable)), [](Callable* c) { CallPython([c] { delete c; }); }};
}

}  // namespace oaslam::python
