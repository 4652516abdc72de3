#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace oaslam {

// Converts a JSON value to text, on one line where `indent` is -1. Bytes that are not UTF-8, which
// names of files may contain, become U+FFFD; by default nlohmann's library would throw.
template <typename Json>
std::string JsonText(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace oaslam
