#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/relocalization/report.h"
#include "oaslam/rigid3.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// A pose that is supported by detected objects. `score` is the statistic S of docs/objects.md
// ("From ellipsoids to a pose"): llr * matched / detections of mapped classes, less a penalty for
// objects that should have been detected and were not.
struct ObjectPoseCandidate {
  Rigid3 cam_from_world;
  double score = 0;
  double margin = 0;                              // score minus that of the best distinct pose
  double llr = 0;                                 // log-likelihood ratio of the matched boxes
  std::vector<std::pair<int, ObjectId>> matched;  // index of the detection, object
  // Of a small motion (translation, rotation [rad]) applied after the pose; 0 without matches.
  PoseCovariance covariance = PoseCovariance::Zero();
  double sigma_position = 0;  // map units, 1 sigma
  bool accepted = false;      // the evidence suffices to report the pose

  // The margin counts more than the score: that every other pose explains the boxes much worse is
  // stronger evidence than that this one explains them well.
  double Evidence() const { return score / 2 + margin; }
};

// Estimates the pose of a camera in the map from its detected objects alone. Returns up to five
// distinct poses, best first, of which only the first can be accepted; none where there are no
// hypotheses. `gravity_in_cam`: direction of gravity in the camera's frame (any length) where a
// sensor gives it; used if the map knows its vertical. `rng` draws triplets of objects where there
// are too many to try all.
std::vector<ObjectPoseCandidate> RelocalizeByObjects(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, const std::optional<Eigen::Vector3d>& gravity_in_cam,
    Rng& rng);

// Refines a pose by points together with the detected objects. `by_points` must be a success.
// Points of a view from an unusual side have correlated errors. So all of them together count as
// one: their covariance is multiplied by their number.
ObjectPoseCandidate RefineByPointsAndObjects(std::span<const ObjectDetection> detections,
                                             const Camera& camera, const Map& map,
                                             const RelocalizationConfig& config,
                                             const RelocalizationReport& by_points);

}  // namespace oaslam
