#include "oaslam/service/map_store.h"

#include <algorithm>

#include "oaslam/error.h"
#include "oaslam/service/map_database.h"
#include "oaslam/service/map_folder.h"

namespace oaslam {

void CheckMapName(const std::string& name) {
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  if (name.empty() || name.size() > 64 || name.front() == '.' ||
      !std::ranges::all_of(name, is_allowed))
    throw InputError(
        "the name of a map has 1 to 64 letters, digits, '.', '_' and '-', the first no '.'");
}

std::unique_ptr<MapStore> OpenMapStore(const std::string& location) {
  if (location.starts_with("postgresql://") || location.starts_with("postgres://"))
    return OpenMapDatabase(location);
  return OpenMapFolder(location);
}

}  // namespace oaslam
