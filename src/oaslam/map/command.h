#pragma once

#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// A point of the first two keyframes.
struct InitialPoint {
  int first_keypoint = 0, second_keypoint = 0;
  // In the first camera's frame, for a baseline of 1.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

// A new map from two frames.
struct InitialMap {
  Frame first, second;
  KeyframeId first_id, second_id;
  Rigid3 second_from_first;  // |translation| = 1
  std::vector<InitialPoint> points;
  Rigid3 second_from_world;
  Rigid3 motion;  // second from first by the odometry, in the unit of the map
};

// How often a landmark was expected in a frame since the last keyframe, and how often it was found.
struct LandmarkUse {
  LandmarkId landmark;
  int visible = 0, found = 0;
};

struct KeyframeInsertion {
  KeyframeId id;
  TrackedFrame frame;
  // To this keyframe and to earlier ones, as the odometry knows them by now.
  std::vector<std::pair<KeyframeId, KeyframeMotion>> motions{};
  int loops_closed = 0;  // in the map whose unit the motions have
};

}  // namespace oaslam
