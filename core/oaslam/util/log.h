#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "oaslam/log.h"

namespace oaslam {

// Gives a message to the sink (SetLogSink), which all libraries of a program share. Any thread may
// call it; it holds no lock while the sink runs.
OASLAM_API void Log(LogLevel level, const std::string& message);

// Logs a message that is made as by fmt::format.
template <typename First, typename... Rest>
void Log(LogLevel level, fmt::format_string<First, Rest...> format, First&& first, Rest&&... rest) {
  Log(level, fmt::format(format, std::forward<First>(first), std::forward<Rest>(rest)...));
}

}  // namespace oaslam
