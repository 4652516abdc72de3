#pragma once

#include <functional>
#include <string>

#include "oaslam/export.h"

namespace oaslam {

// How much a message matters.
enum class LogLevel { kDebug, kInfo, kWarning };

// Receives the messages of the library, each on the thread that logs it; several threads may call
// it at once.
using LogSink = std::function<void(LogLevel, const std::string&)>;

// Sets where all messages of the library in this program go:
//
//   SetLogSink([](LogLevel level, const std::string& message) {
//     if (level == LogLevel::kWarning) std::cerr << message << "\n";
//   });
//
// By default warnings go to the standard error stream and the rest is dropped; an empty sink drops
// all. Thread-safe. A sink may call the library, also this function, and may take locks of the
// application, since the library holds none meanwhile; it must not throw. A message that another
// thread is just logging may still go to the previous sink, which lives until that call has
// returned.
OASLAM_API void SetLogSink(LogSink sink);

}  // namespace oaslam
