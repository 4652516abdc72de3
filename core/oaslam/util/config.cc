#include "oaslam/config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <type_traits>

namespace oaslam {

SlamConfig SlamConfig::Live() {
  SlamConfig config;
  config.runner.mode = RunnerMode::kLive;
  return config;
}

SlamConfig SlamConfig::Offline() { return SlamConfig(); }

std::vector<std::string> SlamConfig::Validate() const {
  std::vector<std::string> problems;
  const auto check = [&]<typename Value, typename... Bound>(const char* name, const Value& value,
                                                            const Bound&... bound) {
    if constexpr (std::is_enum_v<Value> || std::is_same_v<Value, bool>) {
      const std::vector<std::string>& words = std::get<0>(std::tie(bound...));
      if (static_cast<size_t>(value) >= words.size())
        problems.push_back(fmt::format("{}: {}, allowed: {}", name, static_cast<size_t>(value),
                                       fmt::join(words, " | ")));
    } else {
      const auto [min, max] = std::tie(bound...);
      if (!(value >= min && value <= max))
        problems.push_back(fmt::format("{}: {}, allowed: {} to {}", name, value, min, max));
    }
  };
  VisitFields(*this, check);
  return problems;
}

}  // namespace oaslam
