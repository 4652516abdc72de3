#pragma once

#include <functional>
#include <string>

#include "oaslam/export.h"

namespace oaslam {

// How much a message matters.
enum class LogLevel { kDebug, kInfo, kWarning };

// Receives the messages of the library, on the thread that has something to say: several threads
// may call it at once.
using LogSink = std::function<void(LogLevel, const std::string&)>;

// Where the messages of the whole program's library go. By default warnings go to the standard
// error stream, and nothing else is said; an empty sink silences them all. Thread-safe. A sink may
// call the library, this function too, and may take locks of the application, since none of ours
// is held; it must not throw. A message that another thread is about to say may still reach the
// sink of before, which is kept until that has returned.
OASLAM_API void SetLogSink(LogSink sink);

}  // namespace oaslam
