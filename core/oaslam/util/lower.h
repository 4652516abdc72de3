#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace oaslam {

// ASCII letters in lower case, whatever the locale is.
inline std::string Lower(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return lower;
}

}  // namespace oaslam
