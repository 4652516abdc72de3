#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace oaslam {

// Decodes triplets such as "%20" (RFC 3986, section 2.1). Nothing where one is malformed.
std::optional<std::string> DecodePercent(std::string_view text);

// Encodes a segment of a path for a URI: all but letters, digits and "-._~" as triplets.
std::string EncodeUriSegment(std::string_view text);

// An address without the name and password that it may have, for messages and names of files.
std::string WithoutPassword(const std::string& url);

}  // namespace oaslam
