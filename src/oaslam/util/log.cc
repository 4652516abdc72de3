#include "oaslam/util/log.h"

#include <fmt/format.h>

#include <cstdio>
#include <mutex>

namespace oaslam {
namespace {

// Any thread may log while another installs a sink: the one lock of the library that is not a
// queue's.
std::mutex sink_mutex;
LogSink& Sink() {
  static LogSink sink = [](LogLevel level, const std::string& message) {
    if (level == LogLevel::kWarning) fmt::print(stderr, "oaslam: warning: {}\n", message);
  };
  return sink;
}

}  // namespace

void SetLogSink(LogSink sink) {
  const std::lock_guard lock(sink_mutex);
  Sink() = std::move(sink);
}

void Log(LogLevel level, const std::string& message) {
  const std::lock_guard lock(sink_mutex);
  if (Sink()) Sink()(level, message);
}

}  // namespace oaslam
