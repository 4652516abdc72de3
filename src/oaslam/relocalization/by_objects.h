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

// A pose that detected objects speak for. `score` is the statistic S of docs/objects.md ("From
// ellipsoids to a pose"): llr * matched / detections of mapped classes - penalty for objects that
// should have been detected.
struct ObjectPoseCandidate {
  Rigid3 cam_from_world;
  double score = 0;
  double margin = 0;                              // score less that of the best pose elsewhere
  double llr = 0;                                 // log-likelihood ratio of the matched boxes
  std::vector<std::pair<int, ObjectId>> matched;  // index of the detection, object
  double sigma_position = 0;                      // map units, 1 sigma
  bool accepted = false;                          // the evidence suffices to stand behind the pose

  // That another pose explains the boxes much worse says more than how well this one does.
  double Evidence() const { return score / 2 + margin; }
};

// Poses of a camera from its detected objects alone, in the map's frame: up to five distinct ones,
// best first; only the first can be accepted. Empty without hypotheses. `gravity_in_cam`: the
// direction of gravity in the camera's frame (any length) where a sensor gives it, used if the map
// knows its up. `rng` thins triplets where there are too many.
std::vector<ObjectPoseCandidate> RelocalizeByObjects(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, const std::optional<Eigen::Vector3d>& gravity_in_cam,
    Rng& rng);

// The pose that points and objects agree on best. `by_points`: a success. From the unusual side
// where objects had to lead the way, the errors of neighbouring points are alike, so that all of
// them together count as one: their covariance is taken times their number.
ObjectPoseCandidate RefineByPointsAndObjects(std::span<const ObjectDetection> detections,
                                             const Camera& camera, const Map& map,
                                             const RelocalizationConfig& config,
                                             const RelocalizationReport& by_points);

}  // namespace oaslam
