#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "oaslam/log.h"

namespace oaslam {

// Gives a message to the sink (SetLogSink), the one of all libraries of a program. From any thread;
// holds no lock meanwhile.
OASLAM_API void Log(LogLevel level, const std::string& message);

// The same for a message that is made as by fmt::format.
template <typename First, typename... Rest>
void Log(LogLevel level, fmt::format_string<First, Rest...> format, First&& first, Rest&&... rest) {
  Log(level, fmt::format(format, std::forward<First>(first), std::forward<Rest>(rest)...));
}

}  // namespace oaslam
