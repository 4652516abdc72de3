#pragma once

#include <functional>
#include <string>

#include "oaslam/export.h"

namespace oaslam {

// How much a message matters.
enum class LogLevel { kDebug, kInfo, kWarning };

// Receives the messages of the library, on the thread that has something to say, one at a time.
using LogSink = std::function<void(LogLevel, const std::string&)>;

// Where the messages of the whole program's library go. By default warnings go to the standard
// error stream, and nothing else is said; an empty sink silences them all. Thread-safe. A sink may
// call the library, this function too; it must not throw.
OASLAM_API void SetLogSink(LogSink sink);

}  // namespace oaslam
