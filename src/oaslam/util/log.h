#pragma once

#include <string>

#include "oaslam/log.h"

namespace oaslam {

// Gives a message to the sink (SetLogSink). From any thread; holds no lock meanwhile.
void Log(LogLevel level, const std::string& message);

}  // namespace oaslam
