#pragma once

#include <string>
#include <string_view>

namespace oaslam {

// A text that a terminal shows and does not obey: control characters except ends of lines and tabs,
// and bytes that are not UTF-8, become "\x1b".
std::string Printable(std::string_view text);

}  // namespace oaslam
