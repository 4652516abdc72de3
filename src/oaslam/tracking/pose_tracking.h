#pragma once

#include <optional>
#include <string>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// A pose with the landmarks that stand for it.
struct TrackReport {
  bool success = false;
  Rigid3 cam_from_world;
  std::vector<LandmarkId> landmarks;  // per key point: inliers only
  int matched = 0, inliers = 0;       // key points with a landmark before, and after, refinement
  KeyframeId reference;               // keyframe that shares most landmarks; invalid on failure
  std::vector<LandmarkId> visible;    // landmarks that the frame should show (TrackLocalMap)
};

// From the frame before and a predicted pose (constant velocity).
TrackReport TrackFromLastFrame(const Frame& frame, const Map& map, const Features& last_features,
                               const std::vector<LandmarkId>& last_landmarks, const Rigid3& predicted_cam_from_world);

// From a keyframe, by descriptors alone, starting at `initial_cam_from_world`.
TrackReport TrackFromKeyframe(const Frame& frame, const Map& map, KeyframeId keyframe, const Rigid3& initial_cam_from_world);

// Takes a first pose and its matches, looks for all landmarks of the keyframes around, and refines the pose on all of them. Succeeds with
// at least `min_inliers`. `radius_scale` widens the search after a relocalization.
TrackReport TrackLocalMap(const Frame& frame, const Map& map, const TrackReport& initial, int min_inliers, double radius_scale = 1);

}  // namespace oaslam
