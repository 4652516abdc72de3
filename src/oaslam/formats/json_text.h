#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace oaslam {

// A JSON value as text, on one line where `indent` is -1. Bytes that are not UTF-8, as names of
// files may have, become U+FFFD; nlohmann's own default throws.
template <typename Json>
std::string JsonText(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace oaslam
