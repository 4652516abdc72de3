#pragma once

#include "oaslam/map/map.h"
#include "oaslam/tracking/odometry_link.h"
#include "oaslam/tracking/pose_tracking.h"

namespace oaslam {

// Finds the pose of an image near the one that its motion predicts. Many landmarks may contradict
// the prediction, few may not. Where it does not succeed, the report has the predicted pose, and
// the few landmarks in view that agree with it. `last`: the newest image with a pose and features.
TrackReport FollowMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                         const OdometryPrediction& predicted, const TrackDemands& demands);

// Where nothing tells how the camera moved, looks for it about its last pose.
TrackReport FollowWithoutMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                                const TrackDemands& demands);

// Gives an image without features the predicted pose, and the landmarks of the last image where
// they must be: these are returned as key points of `features`.
TrackReport CarryByMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                          const OdometryPrediction& predicted, Features& features);

}  // namespace oaslam
