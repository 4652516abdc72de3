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

// The elements of a vector, as a list.
template <typename Json, typename Vector>
Json JsonNumbers(const Vector& vector) {
  Json numbers = Json::array();
  for (const double x : vector) numbers.push_back(x);
  return numbers;
}

}  // namespace oaslam
