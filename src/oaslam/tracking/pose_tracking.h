#pragma once

#include <optional>
#include <string>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// A pose with the landmarks that stand for it.
struct TrackReport {
  bool success = false;
  Rigid3 cam_from_world;
  std::vector<LandmarkId> landmarks;  // per key point: inliers only
  int matched = 0, inliers = 0;       // key points with a landmark before, and after, refinement
  double depth = 0;                   // median, of the inliers
  double spread = 0;  // sum over the inliers of the squared distance from their centre, along the
                      // axis where it is least; image sides
  double relative_sigma =
      0;                 // standard deviation of the position over the median depth of the points
  KeyframeId reference;  // keyframe that shares most landmarks; invalid on failure
  std::vector<LandmarkId> visible;  // landmarks that the frame should show (TrackLocalMap)
};

// From the frame before and a predicted pose. Landmarks are searched within `radius` of where they
// should be, in pixels of the lowest pyramid level, larger on the others.
TrackReport TrackFromLastFrame(const Frame& frame, const Map& map, const Features& last_features,
                               const std::vector<LandmarkId>& last_landmarks,
                               const Rigid3& predicted_cam_from_world, double radius);

// From another image whose landmarks are known, by descriptors alone: P3P in RANSAC. However far
// the camera has moved since.
TrackReport TrackByDescriptors(const Frame& frame, const Map& map, const Features& from,
                               const std::vector<LandmarkId>& seen, Rng& rng);

// What a pose needs to be followed.
struct TrackDemands {
  int inliers = 30;  // enough of them, wherever they are; fewer must be most of what was found
  int least_inliers = 15;
  double relative_sigma = 0.02;  // of the position at most (TrackReport)
  double spread = 0;             // at least (TrackReport)
  double least_share = 0;        // of the matches, that has to agree
  double radius_scale = 1;       // widens the search, after a relocalization
};

// Takes a first pose and its matches, looks for all landmarks of the keyframes around, and refines
// the pose on all of them. Succeeds where it meets the demands.
TrackReport TrackLocalMap(const Frame& frame, const Map& map, const TrackReport& initial,
                          const TrackDemands& demands);

// Corrects a pose that stands on few landmarks, or on those of one corner of the image, by the
// matches of all key points with the image before (RefinePoseByMatches); landmarks that no longer
// agree are dropped.
TrackReport StrengthenByMatches(const Frame& frame, const Map& map, const Features& before,
                                const Rigid3& before_from_world, const TrackReport& tracked,
                                const TrackDemands& demands);

}  // namespace oaslam
