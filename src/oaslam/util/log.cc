#include "oaslam/util/log.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <mutex>
#include <utility>

namespace oaslam {
namespace {

// Any thread may log while another installs a sink: the one lock of the library that is not a
// queue's. A sink may call the library, which may have something to say: it is recursive, and the
// sink stays alive until its call returns.
std::recursive_mutex sink_mutex;
std::shared_ptr<const LogSink>& Sink() {
  static auto sink =
      std::make_shared<const LogSink>([](LogLevel level, const std::string& message) {
        if (level == LogLevel::kWarning) fmt::print(stderr, "oaslam: warning: {}\n", message);
      });
  return sink;
}

}  // namespace

void SetLogSink(LogSink sink) {
  auto next = std::make_shared<const LogSink>(std::move(sink));
  const std::lock_guard lock(sink_mutex);
  std::swap(Sink(), next);
}

void Log(LogLevel level, const std::string& message) {
  const std::lock_guard lock(sink_mutex);
  const std::shared_ptr<const LogSink> sink = Sink();
  if (*sink) (*sink)(level, message);
}

}  // namespace oaslam
