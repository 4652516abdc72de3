#pragma once

#include "oaslam/map/map.h"
#include "oaslam/tracking/image_pose.h"
#include "oaslam/tracking/map_drift.h"
#include "oaslam/tracking/odometry_link.h"
#include "oaslam/tracking/pose_tracking.h"

namespace oaslam {

// A pose is uncertain below this confidence.
inline constexpr double kSureConfidence = 0.9;

// How sure a pose in the map is (docs/lab/uncertainty.md): by its own measurement, by how the part
// of the map in view is tied to the rest, and by how well this film holds its scale.
class PoseCertainty {
 public:
  // The answer for an image with a pose in the map. `seen_confidence`: the highest
  // confidence of the poses that the map gave since the camera was last lost. It never falls, since
  // a pose near where the motion led is as right as the one before it.
  ImagePose Rate(const Frame& frame, const Map& map, const TrackReport& tracked,
                 TrackingState state, const OdometryLink& link, MapUse use,
                 double& seen_confidence);

 private:
  MapDrift drift_;
  Parting parting_;
};

}  // namespace oaslam
