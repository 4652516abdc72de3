#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/mapping/map_command.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/tracking/pose_tracking.h"

namespace oaslam {

// Finds two frames with enough parallax for an initial map, among those between which the odometry
// knows the motion. It tracks the key points of up to four reference frames, and adds a reference
// when the newest one has lost a share of its matches: a fast camera soon needs a new reference,
// while a slow one gets its parallax from an old reference.
class Initializer {
 public:
  // Processes the next frame. Returns the initial map, without keyframe ids, once one is reliable.
  std::optional<InitialMap> Process(const Frame& frame);
  // Begins anew. Returns the frames of the last seconds before the second frame of the initial map,
  // in order, so that they can be tracked in the map afterwards.
  std::vector<Frame> Reset();
  // Why there is no map yet, as text for the user, such as "the camera has not moved" or "too few
  // corners in the image".
  const std::string& why_not() const { return why_not_; }

 private:
  // A frame that may become the first of the map, and where its key points were last found.
  struct Reference {
    Frame frame;
    std::vector<Eigen::Vector2d> last_seen;  // by key point
    int matches = 0;                         // with the newest frame
    int first_matches = 0;             // the largest number so far, usually with the next frame
    std::optional<double> last_try{};  // time stamp of the last attempt that failed
  };

  // The number of matches that two views need for a map: fewer where the image has few corners.
  int NeededMatches(const Frame& frame) const;
  KeypointPairs Follow(Reference& reference, const Frame& frame) const;
  std::optional<InitialMap> Try(const Reference& reference, const Frame& frame,
                                const KeypointPairs& pairs);

  std::deque<Reference> references_;  // oldest first
  std::deque<Frame> recent_;          // the newest included
  std::string why_not_;
};

struct FrameBeforeMap {
  Frame frame;
  FramePose pose;
  std::vector<LandmarkId> landmarks;  // by key point; empty where the pose is by the motion alone
};

// Tracks the frames that came before the initial map near their poses by the odometry: forward from
// the map's first keyframe to its second, and backward from the first until tracking fails. `now`:
// the motion of the second keyframe; `depth`: the median depth of its landmarks, map units.
std::vector<FrameBeforeMap> PlaceFramesBeforeMap(const std::vector<Frame>& frames, const Map& map,
                                                 KeyframeId first, const FrameMotion& now,
                                                 double depth, const TrackDemands& demands);

}  // namespace oaslam
