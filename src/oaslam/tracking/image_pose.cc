#include "oaslam/tracking/image_pose.h"

#include "oaslam/tracking/odometry_link.h"
#include "oaslam/tracking/pose_certainty.h"

namespace oaslam {

ImagePose PoseWithoutLandmarks(PoseSource source, const ExpectedPose& pose, double confidence) {
  return {.state = TrackingState::kObjects,
          .source = source,
          .cam_from_world = pose.cam_from_world,
          .covariance = pose.Covariance(),
          .confidence = confidence,
          .is_uncertain = confidence < kSureConfidence};
}

ImagePose PoseBeforeMap(const FrameMotion* motion) {
  if (!motion) return {.state = TrackingState::kInitializing};
  return {.state = TrackingState::kPreliminary,
          .source = PoseSource::kMotion,
          .cam_from_world = motion->cam_from_odom,
          .covariance = ExpectedPose{{}, kUnknownWay, kUnknownWay}.Covariance(),
          .is_uncertain = true};
}

Relocalization TrackedAt(const Rigid3& cam_from_world, double depth) {
  Relocalization tracked;
  tracked.evidence = PoseEvidence::kPoints;
  tracked.cam_from_world = cam_from_world;
  const double sigma = kTrackedSigma * depth;
  tracked.covariance.diagonal().head<3>().setConstant(sigma * sigma / 3);
  return tracked;
}

}  // namespace oaslam
