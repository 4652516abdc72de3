#pragma once

#include <string>

#include "oaslam/log.h"

namespace oaslam {

// Gives a message to the sink (SetLogSink), the one of all libraries of a program. From any thread;
// holds no lock meanwhile.
OASLAM_API void Log(LogLevel level, const std::string& message);

}  // namespace oaslam
