#pragma once

#include <optional>

#include "oaslam/map/map.h"
#include "oaslam/tracking/keyframe_decision.h"
#include "oaslam/tracking/odometry_link.h"
#include "oaslam/tracking/pose_tracking.h"

namespace oaslam {

// Decides which images become keyframes, by what has changed since the newest one.
class KeyframeMaker {
 public:
  // Takes note of the newest image's motion.
  void Watch(const Frame& frame);
  // Whether an image with a pose should become a keyframe.
  KeyframeNeed Need(const Frame& frame, const Map& map, const TrackReport& tracked,
                    TrackingState state, const OdometryLink& link) const;
  // An image has become a keyframe, with so many landmarks.
  void Made(KeyframeId id, double timestamp, int inliers);

  KeyframeId newest() const { return newest_; }

 private:
  KeyframeId newest_;
  double newest_at_ = 0;  // time stamp
  int newest_inliers_ = 0;
  bool view_has_changed_ = false;  // since then, as the odometry sees it
};

}  // namespace oaslam
