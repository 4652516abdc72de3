#pragma once

#include <fmt/format.h>

#include <array>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "oaslam/formats/json_text.h"
#include "oaslam/types.h"

namespace oaslam {

// What the readers of detections in JSON share.

// The content of a file. Throws InputError.
nlohmann::json ParseDetections(const std::string& path);

// Counts boxes that cannot be used: a few are left out, many mean that the file is in another
// format.
class LeftOut {
 public:
  // Calls `read`; false where it refused a box.
  bool Try(const std::function<void()>& read);
  // Throws InputError where too many were refused, and warns of a few.
  void Check() const;

 private:
  int count_ = 0, total_ = 0;
  std::string first_;
};

// The place of a value in the file, for messages.
struct JsonPlace {
  const std::string& path;
  std::string entry;

  // These throw InputError.
  [[noreturn]] void Refuse(const std::string& problem) const;
  // Calls Refuse if `problem`, about the value of this key, is not empty.
  void RefuseIf(const std::string& problem, const char* key) const;
  const nlohmann::json& Member(const nlohmann::json& object, const char* key) const;
  double Number(const nlohmann::json& value, const char* key) const;
  template <size_t N>
  std::array<double, N> Numbers(const nlohmann::json& value, const char* key) const {
    if (!value.is_array() || value.size() != N)
      Refuse(fmt::format("{}: {}, expected {} numbers", key, JsonText(value), N));
    std::array<double, N> numbers{};
    for (size_t i = 0; i < N; ++i) numbers[i] = Number(value[i], key);
    return numbers;
  }
};

// These throw InputError.
int CategoryOf(const nlohmann::json& id, const char* key, const JsonPlace& place);
int ReadCategory(const nlohmann::json& entry, const JsonPlace& place);
double ReadScore(const nlohmann::json& score, const char* key, const JsonPlace& place);
Box CheckedBox(const Box& box, const JsonPlace& place);
Detection ReadDetection(const nlohmann::json& entry, const JsonPlace& place);

}  // namespace oaslam
