#include "oaslam/log.h"

#include <condition_variable>
#include <iostream>
#include <mutex>

#include "bindings.h"

namespace oaslam::python {
namespace {

// As the library does by itself.
void SayWarnings(LogLevel level, const std::string& message) {
  if (level == LogLevel::kWarning) std::cerr << "oaslam: warning: " + message + "\n";
}

// Whether Python may still be called from any thread, and how many threads do.
std::mutex mutex;
std::condition_variable at_rest;
int at_work = 0;       // guarded, as the next one
bool is_over = false;  // the interpreter ends

// Calls a function with Python's lock, on any thread; not once the interpreter ends. No lock of
// ours is held meanwhile.
template <typename Function>
void CallPython(Function&& function) {
  {
    const std::lock_guard lock(mutex);
    if (is_over) return;
    ++at_work;
  }
  {
    const py::gil_scoped_acquire gil;
    function();
  }
  const std::lock_guard lock(mutex);
  --at_work;
  at_rest.notify_all();
}

// What the callable raises is written to the standard error stream: the message comes from the
// midst of our work, which goes on.
LogSink SinkOf(const py::function& callable) {
  const std::shared_ptr<py::function> kept(new py::function(callable),
                                           [](py::function* f) { CallPython([f] { delete f; }); });
  return [kept](LogLevel level, const std::string& message) {
    CallPython([&] {
      try {
        (*kept)(level, message);
      } catch (py::error_already_set& error) {
        error.discard_as_unraisable("the log sink of oaslam");
      }
    });
  };
}

// The sink of before, which needs Python's lock to be deleted, may be deleted here.
void Set(LogSink sink) {
  const WithoutPythonsLock without_gil;
  SetLogSink(std::move(sink));
}

// Our threads may have something to say when the interpreter is no more.
void End() {
  const WithoutPythonsLock without_gil;
  {
    std::unique_lock lock(mutex);
    is_over = true;
    at_rest.wait(lock, [] { return at_work == 0; });
  }
  SetLogSink(&SayWarnings);
}

}  // namespace

void AddLog(py::module_& m) {
  py::enum_<LogLevel>(m, "LogLevel", doc::LogLevel)
      .value("DEBUG", LogLevel::kDebug)
      .value("INFO", LogLevel::kInfo)
      .value("WARNING", LogLevel::kWarning);
  m.def(
      "set_log_sink",
      [](const std::optional<py::function>& sink) { Set(sink ? SinkOf(*sink) : LogSink()); },
      py::arg("sink"), doc::SetLogSink);
  py::module_::import("atexit").attr("register")(py::cpp_function(&End));
}

}  // namespace oaslam::python
