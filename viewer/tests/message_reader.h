#pragma once

#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace oaslam {

// Reads the messages of MessageBuilder as the page does.
struct DecodedMessage {
  nlohmann::json header;
  std::string bytes;
  size_t body = 0;

  explicit DecodedMessage(std::string message) : bytes(std::move(message)) {
    uint32_t length = 0;
    std::memcpy(&length, bytes.data(), 4);
    header = nlohmann::json::parse(bytes.substr(4, length));
    body = 4 + length;
    if (body % 4 != 0) throw std::logic_error("the arrays are not aligned");
  }

  template <typename T>
  std::vector<T> Array(const std::string& name) const {
    size_t at = body;
    for (const auto& array : header.value("arrays", nlohmann::json::array())) {
      const size_t size = array[2].get<size_t>() * (array[1] == "u8" ? 1 : 4);
      if (array[0] == name) {
        std::vector<T> values(array[2].get<size_t>());
        std::memcpy(values.data(), bytes.data() + at, values.size() * sizeof(T));
        return values;
      }
      at += (size + 3) / 4 * 4;
    }
    return {};
  }
};

}  // namespace oaslam
