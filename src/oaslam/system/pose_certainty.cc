// How sure the tracker is of a pose that it gives (docs/lab/uncertainty.md).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "oaslam/system/tracker.h"

namespace oaslam {
namespace {

// Standard deviations of the place of landmarks in view, for each link of a chain of views
// (MapDrift): as a share of the depth, half of how far the film's scales of single images are off
// (OdometryUnit::spread), and in radians. The first views of a map count as a quarter of a link.
// Fitted on eleven films (docs/lab/uncertainty.md).
constexpr double kOfSpread = 0.5, kMostSpread = 0.3, kTurnOfLink = 0.0025, kLeastLinks = 0.25;

// A pose is uncertain below this confidence, or where its position may be off by more than this
// share of the depth.
constexpr double kSure = 0.9, kFar = 0.1;

// The probability that a position is off by less than a tenth of the depth (Maxwell's
// distribution).
double ProbablyNear(double sigma_of_depth) {
  constexpr double kNear = 0.1;
  const double x = kNear / std::max(sigma_of_depth, 1e-9);
  return std::erf(x / std::numbers::sqrt2) -
         std::sqrt(2 / std::numbers::pi) * x * std::exp(-x * x / 2);
}

// The probability that a pose near where the motion led is right, by the landmarks that agree; a
// logistic curve fitted to hypotheses of relocalization.
double ConfidenceOfTracked(int inliers) { return 1 / (1 + std::pow(inliers / 16.0 + 1e-9, -3.7)); }

}  // namespace

Tracker::Outcome Tracker::OutcomeOf(const Frame& frame, const Map& map, const TrackReport& tracked,
                                    TrackingState state) {
  Outcome outcome =
      Outcome::Tracked(state, tracked.cam_from_world, tracked.matched, tracked.inliers);
  outcome.depth = tracked.depth;
  const double links = drift_.LinksTo(map, tracked.reference);
  const double spread = std::min(kMostSpread, (unit_ ? *unit_ : OdometryUnit()).spread);
  const double off = std::sqrt(kLeastLinks + links);
  const ExpectedPose map_error{{}, outcome.depth * kOfSpread * spread * off, kTurnOfLink * off};
  outcome.covariance = tracked.covariance + map_error.Covariance();
  const bool is_seen = state != TrackingState::kOdometry;
  outcome.seconds_without_map = is_seen ? 0 : frame.timestamp - seen_in_map_time_;
  // A pose near where the motion led is as right as the one before; few landmarks confirm it.
  if (is_seen) seen_confidence_ = std::max(seen_confidence_, ConfidenceOfTracked(outcome.inliers));
  const double sigma = std::sqrt(tracked.covariance.topLeftCorner<3, 3>().trace() / 3);
  outcome.confidence =
      seen_confidence_ * (outcome.depth > 0 ? ProbablyNear(sigma / outcome.depth) : 1);
  const double agreeing = frame.motion ? frame.motion->agreeing : 1;
  const bool may_have_parted =
      mapping_ && parting_.Update({frame.timestamp, outcome.inliers, agreeing, links});
  outcome.is_uncertain = may_have_parted || outcome.confidence < kSure ||
                         SigmaOfPosition(outcome.covariance) > kFar * outcome.depth;
  return outcome;
}

// Before there is a map, which will have the frame and the unit of the odometry: a median depth.
Tracker::Outcome Tracker::WithoutMap(const FrameMotion* motion) {
  Outcome outcome;
  outcome.state = motion ? TrackingState::kPreliminary : TrackingState::kInitializing;
  if (!motion) return outcome;
  outcome.cam_from_world = motion->cam_from_odom;
  outcome.covariance = ExpectedPose{{}, kUnknownWay, kUnknownWay}.Covariance();
  outcome.is_uncertain = true;
  return outcome;
}

Tracker::Outcome Tracker::Outcome::ByObjects(const ExpectedPose& pose, double confidence) {
  Outcome outcome = Tracked(TrackingState::kObjects, pose.cam_from_world, 0, 0);
  outcome.covariance = pose.Covariance();
  outcome.confidence = confidence;
  outcome.is_uncertain = confidence < kSure;
  return outcome;
}

}  // namespace oaslam
