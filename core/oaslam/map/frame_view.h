#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"

namespace oaslam {

// The result of tracking the newest frame, for display.
struct FrameView {
  std::shared_ptr<const Map> map;  // as the tracker saw it
  Frame frame;
  // By key point, invalid where unmatched; empty without a pose by points.
  std::vector<LandmarkId> landmarks;
  std::vector<ObjectId> detected;  // by detection: its object, invalid where there is none
  std::optional<FramePose> pose;
  std::optional<Relocalization> relocalization;  // present where a lost camera was looked for
};

}  // namespace oaslam
