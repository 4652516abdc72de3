#include "oaslam/service/map_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "oaslam/error.h"
#include "oaslam/service/map_database.h"
#include "oaslam/service/map_folder.h"

namespace oaslam {

bool IsPlainName(const std::string& name) {
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == 127; };
  if (name.empty() || std::ranges::any_of(name, is_control)) return false;
  try {
    nlohmann::json(name).dump();
    return true;
  } catch (const nlohmann::json::type_error&) {  // not UTF-8
    return false;
  }
}

void CheckMapName(const std::string& name) {
  constexpr size_t kMostBytes = 200;  // names of files have 255, with their extension
  if (name.size() > kMostBytes || name.starts_with('.') || name.find('/') != std::string::npos ||
      !IsPlainName(name))
    throw InputError(
        fmt::format("the name of a map has 1 to {} bytes of UTF-8, none of them '/' or a control "
                    "character, the first no '.'",
                    kMostBytes));
}

std::unique_ptr<MapStore> OpenMapStore(const std::string& location) {
  if (location.starts_with("postgresql://") || location.starts_with("postgres://"))
    return OpenMapDatabase(location);
  return OpenMapFolder(location);
}

}  // namespace oaslam
