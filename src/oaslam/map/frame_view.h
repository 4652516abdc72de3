#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The result of looking for a lost camera in one frame.
struct RelocalizationNote {
  PoseEvidence evidence = PoseEvidence::kNone;
  double confidence = 0;  // [0, 1]
  int inlier_points = 0, matched_objects = 0;
  std::string why_not;  // where evidence is kNone
};

// The result of tracking the newest frame, for display.
struct FrameView {
  std::shared_ptr<const Map> map;  // as the tracker saw it
  Frame frame;
  // By key point, invalid where unmatched; empty without a pose by points.
  std::vector<LandmarkId> landmarks;
  std::vector<ObjectId> detected;  // by detection: its object, invalid where there is none
  std::optional<FramePose> pose;
  std::optional<RelocalizationNote> relocalization;  // present where a lost camera was looked for
};

}  // namespace oaslam
