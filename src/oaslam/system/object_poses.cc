// Poses of a camera that is lost, by the objects that it sees and by its motion since.
#include <numbers>
#include <optional>

#include "oaslam/system/tracker.h"

namespace oaslam {
namespace {

ExpectedPose ExpectedBy(const Relocalization& found) {
  return {found.cam_from_world, found.sigma_position() / std::numbers::sqrt3,
          found.objects.relative_sigma};
}

}  // namespace

// A pose by objects of a frame in which the camera is lost. One that is too uncertain for
// tracking.max_object_sigma is given at once, and not kept.
Tracker::Outcome Tracker::ReportObjectPose(const Frame& frame, const Map& map,
                                           const Relocalization& found) {
  const bool is_sure = found.objects.relative_sigma <= config_.tracking.max_object_sigma;
  AddToRegistration(frame, map, found);
  Outcome outcome = is_sure ? ShowPose(frame, map, ExpectedBy(found), found.confidence)
                            : ByRegistration(frame, map);
  if (!outcome.cam_from_world) outcome = Outcome::ByObjects(ExpectedBy(found), found.confidence);
  outcome.objects = static_cast<int>(found.objects.matched.size());
  KeepLost(frame);
  outcome.located = found;
  outcome.located->evidence = PoseEvidence::kObjects;
  return outcome;
}

// Gives a frame in which the camera is lost a pose that does not come from points of the map,
// unless it has one. Tracking does not continue from it.
Tracker::Outcome Tracker::ShowPose(const Frame& frame, const Map& map, const ExpectedPose& pose,
                                   double confidence) {
  const KeyframeId nearest = map.NearestKeyframe(pose.cam_from_world.OriginInSource());
  if (!nearest.IsValid()) return {};
  if (!trajectory_.PoseOf(frame.index))
    trajectory_.Add({frame.index, frame.timestamp, nearest,
                     RelativeTo(map, nearest, pose.cam_from_world), TrackingState::kObjects},
                    frame, {});
  return Outcome::ByObjects(pose, confidence);
}

void Tracker::AddToRegistration(const Frame& frame, const Map& map, const Relocalization& found) {
  const bool knows_unit = unit_ && frame.motion && unit_->run == frame.motion->run;
  registration_.Add(frame, found, knows_unit ? std::optional(unit_->length) : std::nullopt, map);
}

// The pose of a lost camera by the images before that were found in the map, and the motion since.
// With mapping it is given at once, and not kept.
Tracker::Outcome Tracker::ByRegistration(const Frame& frame, const Map& map) {
  const auto registered = registration_.PoseOf(frame);
  if (!registered) return {};
  return mapping_ ? Outcome::ByObjects(registered->pose, registered->agreeing)
                  : ShowPose(frame, map, registered->pose, registered->agreeing);
}

}  // namespace oaslam
