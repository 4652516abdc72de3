#pragma once

#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/tracking/pose_tracking.h"

namespace oaslam {

// The pose of a frame that came before the map was made.
struct FrameBeforeMap {
  Frame frame;
  FramePose pose;
  std::vector<LandmarkId> landmarks;  // by key point; empty where it is by the motion alone
};

// Looks for the frames that came before the initial map about where the odometry has them: forward
// from the map's first keyframe to its second, and backward from the first until tracking fails.
// `now`: the motion of the second keyframe; `depth`: the median depth of its landmarks, map units.
std::vector<FrameBeforeMap> PlaceFramesBeforeMap(const std::vector<Frame>& frames, const Map& map,
                                                 KeyframeId first, const FrameMotion& now,
                                                 double depth, const TrackDemands& demands);

}  // namespace oaslam
