#include "oaslam/log.h"

#include <iostream>

#include "bindings.h"

namespace oaslam::python {
namespace {

// The library's default sink.
void SayWarnings(LogLevel level, const std::string& message) {
  if (level == LogLevel::kWarning) std::cerr << "oaslam: warning: " + message + "\n";
}

// An exception of the callable goes to sys.unraisablehook, since the library must go on with its
// work.
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

// Releases Python's lock, since this may delete the previous sink, which takes it.
void Set(LogSink sink) {
  const WithoutPythonsLock without_gil;
  SetLogSink(std::move(sink));
}

// Threads of the library may still log after the interpreter has ended.
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
