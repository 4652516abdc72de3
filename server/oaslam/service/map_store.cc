#include "oaslam/service/map_store.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "oaslam/storage/map_file.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// Whether a name is UTF-8, not empty, without control characters.
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

void CheckName(const std::string& name, const std::string& what) {
  if (name.size() > 64 || !IsPlainName(name))
    throw InputError("the name of " + what +
                     " has 1 to 64 bytes of UTF-8, none of them a control character");
}

}  // namespace

void CheckMapName(const std::string& name) {
  constexpr size_t kMostBytes = 200;  // names of files have 255, with their extension
  if (name.size() > kMostBytes || name.starts_with('.') || name.find('/') != std::string::npos ||
      !IsPlainName(name))
    throw BadInput(
        "the name of a map has 1 to {} bytes of UTF-8, none of them '/' or a control "
        "character, the first no '.'",
        kMostBytes);
}

std::unique_ptr<MapStore> OpenMapStore(const std::string& location) {
  if (location.starts_with("postgresql://") || location.starts_with("postgres://"))
    return OpenMapDatabase(location);
  std::error_code error;
  if (std::filesystem::is_regular_file(location, error)) LoadMap(location);  // refuses a bad one
  return OpenMapFolder(location);
}

void CheckAnchorEdit(const std::string& name, const std::optional<Anchor>& anchor) {
  CheckName(name, "an anchor");
  if (!anchor) return;
  CheckName(anchor->model, "a model");
  if (!anchor->keyframe.IsValid())
    throw InputError("anchor \"" + name + "\": it is relative to no keyframe");
  if (!std::isfinite(anchor->size) || !anchor->offset.allFinite() ||
      !anchor->cam_from_anchor.translation.allFinite() ||
      !(std::abs(anchor->cam_from_anchor.rotation.norm() - 1) < 1e-3))
    throw InputError("anchor \"" + name + "\": its size and pose must be finite");
}

}  // namespace oaslam
