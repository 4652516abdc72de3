#pragma once

#include <string>
#include <string_view>

namespace oaslam {

// The SHA-256 of bytes, in 64 hexadecimal digits of lower case.
std::string Sha256(std::string_view bytes);

}  // namespace oaslam
