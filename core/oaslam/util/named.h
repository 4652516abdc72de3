#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string_view>

namespace oaslam {

// A value of an enumeration and its name. An array of them is its table of names.
template <typename Enum>
struct Named {
  Enum value;
  const char* name;
};

// Returns the name of a value; for a value that is not in the table, the first name of the table.
template <typename Enum, size_t N>
const char* NameIn(const Named<Enum> (&table)[N], Enum value) {
  const auto found = std::ranges::find(table, value, &Named<Enum>::value);
  return found == std::end(table) ? table[0].name : found->name;
}

template <typename Enum, size_t N>
std::optional<Enum> ValueIn(const Named<Enum> (&table)[N], std::string_view name) {
  const auto found = std::ranges::find(table, name, &Named<Enum>::name);
  return found == std::end(table) ? std::nullopt : std::optional(found->value);
}

}  // namespace oaslam
