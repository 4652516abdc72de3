#pragma once

#include <string>

#include "oaslam/log.h"

namespace oaslam {

// Gives a message to the sink (SetLogSink).
void Log(LogLevel level, const std::string& message);

}  // namespace oaslam
