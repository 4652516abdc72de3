#include "oaslam/tracking/image_pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "oaslam/tracking/odometry_link.h"

namespace oaslam {
namespace {

// Standard deviations of the place of landmarks in view, for each link of a chain of views
// (MapDrift): as a share of the depth, half of how far the film's scales of single images are off
// (OdometryLink::spread), and in radians. The first views of a map count as a quarter of a link.
// Fitted on eleven films (docs/lab/uncertainty.md).
constexpr double kOfSpread = 0.5, kMostSpread = 0.3, kTurnOfLink = 0.0025, kLeastLinks = 0.25;

// A pose is uncertain where its position may be off by more than this share of the depth.
constexpr double kFar = 0.1;

// The probability that a position is off by less than a tenth of the depth (Maxwell's
// distribution).
double ProbablyNear(double sigma_of_depth) {
  constexpr double kNear = 0.1;
  const double x = kNear / std::max(sigma_of_depth, 1e-9);
  return std::erf(x / std::numbers::sqrt2) -
         std::sqrt(2 / std::numbers::pi) * x * std::exp(-x * x / 2);
}

// The covariance of a position, as of a PoseVector, by the error of the focal length: the camera
// seems nearer to what it sees, or farther away, in proportion.
Eigen::Matrix3d OffByFocal(const Camera& camera, const TrackReport& tracked) {
  const double sigma = camera.focal_sigma * tracked.depth;
  return Eigen::Vector3d(0, 0, sigma * sigma).asDiagonal();
}

// The probability that a pose near where the motion led is right, by the landmarks that agree; a
// logistic curve fitted to hypotheses of relocalization.
double ConfidenceOfTracked(int inliers) { return 1 / (1 + std::pow(inliers / 16.0 + 1e-9, -3.7)); }

}  // namespace

ImagePose PoseWithoutLandmarks(PoseSource source, const ExpectedPose& pose, double confidence,
                               double depth) {
  return {.state = TrackingState::kObjects,
          .source = source,
          .cam_from_world = pose.cam_from_world,
          .covariance = pose.Covariance(),
          .confidence = confidence,
          .is_uncertain = confidence < kLeastCertainConfidence,
          .depth = depth};
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

ImagePose PoseCertainty::PoseToReport(const Frame& frame, const Map& map,
                                      const TrackReport& tracked, TrackingState state,
                                      const OdometryLink& link, double& best_confidence) {
  const bool is_seen = state != TrackingState::kOdometry;
  ImagePose pose{
      .state = state,
      .source = is_seen && !frame.features_skipped ? PoseSource::kMap : PoseSource::kMotion,
      .cam_from_world = tracked.cam_from_world,
      .matched = tracked.matched,
      .inliers = tracked.inliers,
      .depth = tracked.depth};
  const ChainOfViews& chain = drift_.ChainTo(map, tracked.reference);
  const double off = std::sqrt(kLeastLinks + chain.links);
  const ExpectedPose map_error{
      {}, pose.depth * kOfSpread * std::min(kMostSpread, link.spread()) * off, kTurnOfLink * off};
  const PoseCovariance local = tracked.covariance + map_error.Covariance();
  pose.covariance = local;
  pose.covariance.topLeftCorner<3, 3>() += OffByFocal(*frame.camera, tracked);
  pose.covariance.diagonal().head<3>().array() +=
      chain.SquaredOffByScale(tracked.cam_from_world.OriginInSource()) / 3;
  pose.seconds_without_map = is_seen ? 0 : frame.timestamp - link.seen_at();
  if (is_seen) best_confidence = std::max(best_confidence, ConfidenceOfTracked(pose.inliers));
  const double sigma = std::sqrt(tracked.covariance.topLeftCorner<3, 3>().trace() / 3);
  pose.confidence = best_confidence * (pose.depth > 0 ? ProbablyNear(sigma / pose.depth) : 1);
  // What the motion alone carries on has no keyframe yet that would tell whether it is loose.
  constexpr double kLongWithoutMap = 0.2;
  pose.is_uncertain =
      parts_.IsLoose(map, tracked.reference) || pose.seconds_without_map >= kLongWithoutMap ||
      pose.confidence < kLeastCertainConfidence || SigmaOfPosition(local) > kFar * pose.depth;
  return pose;
}

}  // namespace oaslam
