#include "oaslam/service/anchor_edit.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "oaslam/error.h"

namespace oaslam {
namespace {

bool IsUtf8(const std::string& text) {
  try {
    nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::type_error&) {
    return false;
  }
}

void CheckName(const std::string& name, const std::string& what) {
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == 127; };
  if (name.empty() || name.size() > 64 || std::ranges::any_of(name, is_control) || !IsUtf8(name))
    throw InputError("the name of " + what +
                     " has 1 to 64 bytes of UTF-8, none of them a control character");
}

}  // namespace

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
