#include "oaslam/log.h"

#include <iostream>

#include "bindings.h"

namespace oaslam::python {
namespace {

// As the library does by itself.
void SayWarnings(LogLevel level, const std::string& message) {
  if (level == LogLevel::kWarning) std::cerr << "oaslam: warning: " + message + "\n";
}

// What the callable raises is written to the standard error stream: the message comes from the
// midst of our work, which goes on.
LogSink SinkOf(const py::function& callable) {
  return [kept = KeptFromPython(callable)](LogLevel level, const std::string& message) {
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
  EndPythonCalls();
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
