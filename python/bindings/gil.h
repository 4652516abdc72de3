#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

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

}  // namespace oaslam::python
