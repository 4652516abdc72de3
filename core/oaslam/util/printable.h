#pragma once

#include <string>
#include <string_view>

namespace oaslam {

// Makes a text safe for a terminal: replaces control characters (except line ends and tabs), and
// bytes that are not UTF-8, by escapes such as "\x1b".
std::string Printable(std::string_view text);

}  // namespace oaslam
