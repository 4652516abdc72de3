#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace oaslam {

// Decodes base64 with padding (RFC 4648, section 4), without line breaks. Nothing where the text is
// anything else, also where the unused bits of its last character are not zero.
std::optional<std::string> DecodeBase64(std::string_view text);

std::string EncodeBase64(std::string_view bytes);

}  // namespace oaslam
