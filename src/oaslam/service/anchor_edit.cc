#include "oaslam/service/anchor_edit.h"

#include <cmath>

#include "oaslam/error.h"
#include "oaslam/service/map_store.h"

namespace oaslam {
namespace {

void CheckName(const std::string& name, const std::string& what) {
  if (name.size() > 64 || !IsPlainName(name))
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
