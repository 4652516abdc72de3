#pragma once

#include <optional>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/map/firm_parts.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/tracking/map_drift.h"
#include "oaslam/tracking/odometry_link.h"
#include "oaslam/tracking/pose_tracking.h"
#include "oaslam/tracking_result.h"

namespace oaslam {

// Where the camera of an image is in the map, how sure that is, and what supports it.
struct ImagePose {
  TrackingState state = TrackingState::kLost;
  PoseSource source = PoseSource::kNone;
  std::optional<Rigid3> cam_from_world{};
  PoseCovariance covariance = PoseCovariance::Zero();
  double confidence = 0;  // [0, 1]
  bool is_uncertain = false;
  double seconds_without_map = 0;
  int matched = 0, inliers = 0;  // landmarks: found, and those that agree with the pose
  int objects = 0;               // mapped ones that are seen
  double depth = 0;              // median, of what supports the pose, map units; 0: not known
};

// The pose of a lost camera, without landmarks. `depth`: median depth of what the image shows, map
// units.
ImagePose PoseWithoutLandmarks(PoseSource source, const ExpectedPose& pose, double confidence,
                               double depth);
// The pose before there is a map; the map will have the frame and the unit of the odometry.
// `motion`: null where it is not known.
ImagePose PoseBeforeMap(const FrameMotion* motion);

// The assumed standard deviation of a position tracked by points, as a share of the depth, where
// landmarks are seen from near the places they were mapped from.
inline constexpr double kTrackedSigma = 0.005;
// A pose by landmarks at this median depth, as a search would have found it.
Relocalization TrackedAt(const Rigid3& cam_from_world, double depth);

// A pose is uncertain below this confidence.
inline constexpr double kLeastCertainConfidence = 0.9;

// Computes how certain a pose in the map is (docs/lab/uncertainty.md): from the covariance of its
// own measurement, from how well the part of the map in view is linked to the rest, and from how
// constant the scale is in this recording.
class PoseCertainty {
 public:
  // The result for an image with a pose in the map. `best_confidence`: the highest confidence of
  // the poses that the map gave since the camera was last lost. The confidence of a pose falls
  // below `best_confidence` only by its covariance: each pose was searched near the one before it,
  // so that a small number of landmarks in one image does not make a wrong place likely.
  ImagePose PoseToReport(const Frame& frame, const Map& map, const TrackReport& tracked,
                         TrackingState state, const OdometryLink& link, double& best_confidence);

  // Multiplies the lengths kept here by `factor`, after those of the map were.
  void Scale(double factor) { drift_.Scale(factor); }

 private:
  MapDrift drift_;
  FirmParts parts_;
};

}  // namespace oaslam
