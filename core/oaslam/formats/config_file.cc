#include "oaslam/config_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>
#include <type_traits>
#include <vector>

#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

std::vector<std::string> KnownKeys() {
  std::vector<std::string> keys;
  SlamConfig config = SlamConfig::Offline();
  VisitFields(config,
              [&](const char* name, const auto&, const auto&...) { keys.emplace_back(name); });
  return keys;
}

template <typename Value>
constexpr bool kIsNamed = std::is_enum_v<Value> || std::is_same_v<Value, bool>;

template <typename Value, typename... Bound>
requires kIsNamed<Value> std::optional<std::string> Assign(const YAML::Node& node, Value& value,
                                                           const Bound&... bound) {
  const std::vector<std::string>& words = std::get<0>(std::tie(bound...));
  const auto word = node.IsScalar() ? std::ranges::find(words, node.Scalar()) : words.end();
  if (word == words.end())
    return fmt::format("{}, allowed: {}", TextOfNode(node), fmt::join(words, " | "));
  value = static_cast<Value>(word - words.begin());
  return std::nullopt;
}

template <typename Number, typename... Bound>
requires(!kIsNamed<Number>) std::optional<std::string> Assign(const YAML::Node& node, Number& value,
                                                              const Bound&... bound) {
  const auto [min, max] = std::tie(bound...);
  const auto number = node.IsScalar() ? ParseNumber(node.Scalar()) : std::nullopt;
  if (!number) return fmt::format("{}, expected a number", TextOfNode(node));
  if (std::is_integral_v<Number> && *number != std::floor(*number))
    return fmt::format("{}, expected a whole number", *number);
  if (!(*number >= static_cast<double>(min) && *number <= static_cast<double>(max)))
    return fmt::format("{}, allowed: {} to {}", *number, min, max);
  value = static_cast<Number>(*number);
  return std::nullopt;
}

// Sets a value; returns what is wrong with it, or nothing if it was set.
std::optional<std::string> SetField(SlamConfig& config, const std::string& key,
                                    const YAML::Node& node) {
  bool known = false;
  std::optional<std::string> problem;
  VisitFields(config, [&](const char* name, auto& value, const auto&... bound) {
    if (key != name) return;
    known = true;
    problem = Assign(node, value, bound...);
  });
  if (!known)
    return fmt::format("{}: unknown key, the nearest is {}", key, NearestOf(KnownKeys(), key));
  if (problem) return fmt::format("{}: {}", key, *problem);
  return std::nullopt;
}

bool IsSection(const std::string& name) {
  return std::ranges::any_of(KnownKeys(),
                             [&](const std::string& key) { return key.starts_with(name + "."); });
}

}  // namespace

void LoadConfig(const std::string& path, SlamConfig& config) {
  SlamConfig changed = config;
  std::vector<std::string> problems;
  std::set<std::string> seen;
  const auto set = [&](const std::string& key, const YAML::Node& key_node,
                       const YAML::Node& value) {
    auto problem = SetField(changed, key, value);
    if (!problem && !seen.insert(key).second) problem = fmt::format("{}: given twice", key);
    if (problem)
      problems.push_back(fmt::format("{}:{}: {}", path, key_node.Mark().line + 1, *problem));
  };
  for (const auto& section : ParseYamlMapping(ReadTextFile(path), path)) {
    const std::string name = section.first.Scalar();
    if (section.second.IsMap()) {
      for (const auto& entry : section.second)
        set(name + "." + entry.first.Scalar(), entry.first, entry.second);
    } else if (!section.second.IsNull() || !IsSection(name)) {
      set(name, section.first, section.second);
    }
  }
  if (!problems.empty()) throw BadInput("{}", fmt::join(problems, "\n"));
  config = changed;
}

void ApplySetting(const std::string& assignment, SlamConfig& config) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos) throw BadInput("{}: expected section.key=value", assignment);
  const std::string key(Trim(std::string_view(assignment).substr(0, equals)));
  const std::string value(Trim(std::string_view(assignment).substr(equals + 1)));
  if (const auto problem = SetField(config, key, YAML::Node(value))) throw InputError(*problem);
}

std::string ConfigToYaml(const SlamConfig& config) {
  std::string text, section;
  VisitFields(config, [&](const std::string& name, const auto& value, const auto&... bound) {
    const size_t dot = name.find('.');
    if (name.substr(0, dot) != section) {
      section = name.substr(0, dot);
      text += section + ":\n";
    }
    if constexpr (kIsNamed<std::decay_t<decltype(value)>>)
      text += fmt::format("  {}: {}\n", name.substr(dot + 1),
                          std::get<0>(std::tie(bound...)).at(static_cast<size_t>(value)));
    else
      text += fmt::format("  {}: {}\n", name.substr(dot + 1), value);
  });
  return text;
}

}  // namespace oaslam
