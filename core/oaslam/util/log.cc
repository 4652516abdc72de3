#include "oaslam/util/log.h"

#include <pthread.h>

#include <cstdio>
#include <memory>
#include <mutex>

namespace oaslam {
namespace {

// Any thread may log while another installs a sink. The lock is not held while a sink works, so
// that a sink may log or install another one.
std::mutex sink_mutex;
// Never destroyed, since destructors of an application's static objects may still log.
std::shared_ptr<const LogSink>& Sink() {
  static auto& sink = *new std::shared_ptr<const LogSink>(
      std::make_shared<const LogSink>([](LogLevel level, const std::string& message) {
        if (level == LogLevel::kWarning) fmt::print(stderr, "oaslam: warning: {}\n", message);
      }));
  return sink;
}

// A forked child would find the lock taken for ever if another thread of its parent held it.
[[maybe_unused]] const int locked_while_forking = pthread_atfork(
    [] { sink_mutex.lock(); }, [] { sink_mutex.unlock(); }, [] { sink_mutex.unlock(); });

std::shared_ptr<const LogSink> CurrentSink() {
  const std::lock_guard lock(sink_mutex);
  return Sink();
}

}  // namespace

void SetLogSink(LogSink sink) {
  auto next = std::make_shared<const LogSink>(std::move(sink));
  const std::lock_guard lock(sink_mutex);
  // Swapped, not assigned: the previous sink is destroyed after the lock is released, since its
  // destructor may log.
  std::swap(Sink(), next);
}

void Log(LogLevel level, const std::string& message) {
  const std::shared_ptr<const LogSink> sink = CurrentSink();
  if (*sink) (*sink)(level, message);
}

}  // namespace oaslam
