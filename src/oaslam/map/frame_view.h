#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// What came of looking for a lost camera in one frame.
struct RelocalizationNote {
  PoseEvidence evidence = PoseEvidence::kNone;
  double confidence = 0;  // [0, 1]
  int inlier_points = 0, matched_objects = 0;
  std::string why_not;  // where evidence is kNone
};

// What the tracker made of the newest frame, for display.
struct FrameView {
  std::shared_ptr<const Map> map;  // as the tracker saw it
  Frame frame;
  std::vector<LandmarkId>
      landmarks;  // per key point, invalid where unmatched; empty without a pose by points
  std::vector<ObjectId> detected;  // per detection: its object, invalid where none
  std::optional<FramePose> pose;
  std::optional<RelocalizationNote> relocalization;  // where the camera was looked for
};

}  // namespace oaslam
