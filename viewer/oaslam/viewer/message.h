#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace oaslam {

// A message to the page: a JSON header that names the arrays behind it (docs/viewer.md).
//   u32 length of the header, little-endian | header, padded with blanks to a multiple of 4 |
//   arrays, each padded with zeros likewise
// header.arrays: [[name, "f32" | "u32" | "u8", number of elements], ...]
class MessageBuilder {
 public:
  explicit MessageBuilder(const std::string& type) { header["type"] = type; }

  void Add(const std::string& name, std::span<const float> values) {
    AddArray(name, "f32", std::as_bytes(values), values.size());
  }
  void Add(const std::string& name, std::span<const uint32_t> values) {
    AddArray(name, "u32", std::as_bytes(values), values.size());
  }
  void Add(const std::string& name, std::span<const uint8_t> values) {
    AddArray(name, "u8", std::as_bytes(values), values.size());
  }

  std::string Finish() &&;

  nlohmann::json header;

 private:
  void AddArray(const std::string& name, const char* type, std::span<const std::byte> bytes,
                size_t count);

  nlohmann::json arrays_ = nlohmann::json::array();
  std::string body_;
};

}  // namespace oaslam
