// What the tracker does with an image in which the camera is lost.
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "oaslam/relocalization/by_points.h"
#include "oaslam/tracking/continuity.h"
#include "oaslam/tracking/tracker.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

ExpectedPose ExpectedBy(const Relocalization& found) {
  return {found.cam_from_world, found.sigma_position() / std::numbers::sqrt3,
          found.objects.relative_sigma};
}

// Of the centers of the objects that were found, along the optical axis; map units.
double MedianDepthOfObjects(const Map& map, const Relocalization& found) {
  std::vector<double> depths;
  for (const auto& [detection, object] : found.objects.matched)
    depths.push_back((found.cam_from_world * map.objects.At(object).ellipsoid.center).z());
  return depths.empty() ? 0 : Median(std::move(depths));
}

}  // namespace

Relocalization Tracker::Find(const Frame& frame, const Map& map, const TrackingContext& context,
                             const std::optional<Rigid3>& prior) {
  newest_.relocalization = search_.Find(frame, map, context, prior);
  return *newest_.relocalization;
}

TrackingStep Tracker::PlaceFound(const Frame& frame, const Map& map, const Relocalization& found,
                                 const TrackingContext& context) {
  if (!found.IsFound()) return Miss(frame, map, context);
  if (found.evidence == PoseEvidence::kObjects) return PlaceByObjects(frame, map, found, context);
  const auto* lost = std::get_if<Lost>(&phase_);
  const bool is_doubted = lost && lost->is_pose_doubted, is_told = lost && lost->prior;
  // What is mapped from a wrong place on cannot be mended.
  if (context.IsMapping() && !is_told &&
      !TellsPlace(map, map, found, is_doubted ? INFINITY : frame.timestamp - link_.seen_at())) {
    newest_.relocalization->evidence = PoseEvidence::kNone;
    newest_.relocalization->why_not = "all points found lie in one plane, which may hang elsewhere";
    return Miss(frame, map, context);
  }
  const TrackReport tracked = Confirm(frame, map, found, is_doubted);
  return tracked.success ? Continue(frame, map, tracked, TrackingState::kRelocalized, context)
                         : Miss(frame, map, context);
}

// In a map that is only read, nothing but this corrects a pose that the motion carries on: the
// image is looked for in the whole map, from time to time.
std::optional<TrackingStep> Tracker::LookAgain(const Frame& frame, const Map& map,
                                               const TrackingContext& context) {
  if (!search_.IsTimeToLook(frame.timestamp)) return std::nullopt;
  const Relocalization found = Find(frame, map, context, std::nullopt);
  if (found.evidence == PoseEvidence::kNone || found.evidence == PoseEvidence::kObjects)
    return std::nullopt;
  const TrackReport tracked = Confirm(frame, map, found, false);
  if (!tracked.success) return std::nullopt;
  return Continue(frame, map, tracked, TrackingState::kRelocalized, context);
}

// Confirms a pose that was found by points in the local map. The camera must be able to have moved
// there from its last pose, unless that is doubted.
TrackReport Tracker::Confirm(const Frame& frame, const Map& map, const Relocalization& found,
                             bool is_pose_doubted) const {
  constexpr double kWiderSearch = 2;    // the error of a pose by relocalization
  constexpr double kAgreement = 0.225;  // docs/lab/tracking.md
  TrackReport first;
  first.success = true;
  first.cam_from_world = found.cam_from_world;
  first.landmarks = found.points.landmarks;
  first.inliers = found.points.inliers;
  TrackDemands demands = Demands();
  demands.inliers = demands.least_inliers = kMinRelocalizationInliers;
  demands.agreement = kAgreement;
  demands.radius_scale = kWiderSearch;
  TrackReport tracked = TrackLocalMap(frame, map, first, demands);
  if (!tracked.success || is_pose_doubted) return tracked;
  const FramePose here{frame.index, frame.timestamp, tracked.reference,
                       RelativeTo(map, tracked.reference, tracked.cam_from_world),
                       TrackingState::kRelocalized};
  tracked.success = IsContinuous(map, NewestPoses(trajectory_.poses(), frame.timestamp), map,
                                 {&here, 1}, Similarity());
  return tracked;
}

// A pose that is too uncertain for tracking.max_object_sigma is reported, but does not enter the
// trajectory.
TrackingStep Tracker::PlaceByObjects(const Frame& frame, const Map& map,
                                     const Relocalization& found, const TrackingContext& context) {
  const bool is_sure = found.objects.relative_sigma <= config_.tracking.max_object_sigma;
  const ImagePose by_objects = PoseWithoutLandmarks(
      PoseSource::kObjects, ExpectedBy(found), found.confidence, MedianDepthOfObjects(map, found));
  search_.Register(frame, map, found, link_.UnitFor(frame));
  TrackingStep step{is_sure ? Record(frame, map, by_objects)
                            : PlaceByRegistration(frame, map, context)};
  if (!step.pose.cam_from_world) step.pose = by_objects;
  step.pose.objects = static_cast<int>(found.objects.matched.size());
  search_.Keep(frame);
  step.located = found;
  step.located->evidence = PoseEvidence::kObjects;
  return step;
}

// The pose by the images before that were found in the map, and the motion since. With mapping it
// is given at once, and not kept.
ImagePose Tracker::PlaceByRegistration(const Frame& frame, const Map& map,
                                       const TrackingContext& context) {
  const auto registered = search_.Registered(frame);
  if (!registered) return {};
  const ImagePose pose =
      PoseWithoutLandmarks(PoseSource::kRegistration, registered->pose, registered->agreeing,
                           registered->unit * MedianDepthOf(*frame.motion, 0));
  return context.IsMapping() ? pose : Record(frame, map, pose);
}

// Keeps a pose that does not come from points of the map, for an image that has none. Tracking does
// not continue from it.
ImagePose Tracker::Record(const Frame& frame, const Map& map, const ImagePose& pose) {
  const KeyframeId nearest = map.NearestKeyframe(pose.cam_from_world->OriginInSource());
  if (!nearest.IsValid()) return {};
  if (!trajectory_.PoseOf(frame.index))
    trajectory_.Add({frame.index, frame.timestamp, nearest,
                     RelativeTo(map, nearest, *pose.cam_from_world), TrackingState::kObjects},
                    frame, {});
  return pose;
}

TrackingStep Tracker::Miss(const Frame& frame, const Map& map, const TrackingContext& context) {
  search_.Keep(frame);
  return {PlaceByRegistration(frame, map, context)};
}

}  // namespace oaslam
