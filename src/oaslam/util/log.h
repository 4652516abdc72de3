#pragma once

#include <functional>
#include <string>

namespace oaslam {

enum class LogLevel { kDebug, kInfo, kWarning };

// Receives the messages of the library; without a sink they are dropped. The command installs one.
using LogSink = std::function<void(LogLevel, const std::string&)>;
void SetLogSink(LogSink sink);
void Log(LogLevel level, const std::string& message);

}  // namespace oaslam
