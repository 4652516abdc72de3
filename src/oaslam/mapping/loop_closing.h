#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// A point of the world moved by a similarity.
struct Similarity {
  double scale = 1;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return scale * (rotation * x) + translation; }
};

// A keyframe that came back to a part of the map it is not connected with.
struct LoopClosure {
  KeyframeId current, old;                                      // `old`: the oldest side of the loop
  Similarity old_from_current;                                  // moves what lies at `current` to where it belongs
  std::vector<std::pair<uint32_t, LandmarkId>> old_landmarks;   // key points of `current` that show them
};

// Looks for keyframes near `current` in space and direction that share nothing with it and its neighbours, and verifies by descriptors, P3P
// and a guided search that it sees their landmarks. The drift around a loop has to be less than half of the depth of the scene.
std::optional<LoopClosure> DetectLoop(const Map& map, KeyframeId current, Rng& rng);

// Spreads the correction over the keyframes between both ends of the loop, in their order in time, joins the landmarks of both ends, and
// refines everything by bundle adjustment.
void CorrectLoop(const LoopClosure& loop, int min_shared_landmarks, Map& map);

}  // namespace oaslam
