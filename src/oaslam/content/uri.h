#pragma once

#include <string>
#include <string_view>

namespace oaslam {

// "%20" and the like become the bytes they stand for (RFC 3986, section 2.1); what is no such
// triplet stays.
std::string DecodeUri(std::string_view text);

// A segment of a path as it stands in a URI: all but letters, digits and "-._~" as triplets.
std::string EncodeUriSegment(std::string_view text);

}  // namespace oaslam
