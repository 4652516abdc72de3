#include "oaslam/log.h"

#include <iostream>
#include <mutex>

#include "bindings.h"

namespace oaslam::python {
namespace {

// As the library does by itself.
void SayWarnings(LogLevel level, const std::string& message) {
  if (level == LogLevel::kWarning) std::cerr << "oaslam: warning: " + message + "\n";
}

// Held while a sink calls Python. At its end the interpreter waits for that.
std::recursive_mutex at_work;

// Calls Python from any thread, one at a time. What the callable raises is written to the standard
// error stream: the message comes from the midst of our work, which goes on.
LogSink SinkOf(const py::function& callable) {
  const std::shared_ptr<py::function> kept(new py::function(callable), [](py::function* f) {
    const py::gil_scoped_acquire gil;
    delete f;
  });
  return [kept](LogLevel level, const std::string& message) {
    // Who holds Python's lock must not wait for a sink that needs it.
    std::optional<py::gil_scoped_release> without_gil;
    if (PyGILState_Check()) without_gil.emplace();
    const std::lock_guard lock(at_work);
    const py::gil_scoped_acquire gil;
    try {
      (*kept)(level, message);
    } catch (py::error_already_set& error) {
      error.discard_as_unraisable("the log sink of oaslam");
    }
  };
}

// Returns once the sink of before is at rest. Who waits for that must not hold Python's lock, which
// the sink needs.
void Set(LogSink sink) {
  const py::gil_scoped_release without_gil;
  SetLogSink(std::move(sink));
  const std::lock_guard lock(at_work);
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
  // Our threads may have something to say when the interpreter is no more.
  py::module_::import("atexit").attr("register")(py::cpp_function([] { Set(&SayWarnings); }));
}

}  // namespace oaslam::python
