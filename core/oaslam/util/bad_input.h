#pragma once

#include <fmt/format.h>

#include <utility>

#include "oaslam/error.h"

namespace oaslam {

// An InputError whose message is made as by fmt::format.
template <typename... Args>
InputError BadInput(fmt::format_string<Args...> format, Args&&... args) {
  return InputError(fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace oaslam
