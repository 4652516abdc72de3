#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "oaslam/map/map.h"

namespace oaslam {
namespace {

using Problems = std::vector<std::string>;

constexpr const char* kUnsound = "not finite, or its rotation no unit quaternion";

void CheckKeyframe(const Map& map, KeyframeId id, const Keyframe& keyframe, Problems& problems) {
  if (!keyframe.features || keyframe.landmarks.size() != keyframe.features->keypoints.size())
    return problems.push_back(
        fmt::format("keyframe {}: landmarks and key points differ in number", id.value));
  if (!keyframe.HasSoundLearned())
    problems.push_back(
        fmt::format("keyframe {}: learned descriptors do not fit the key points", id.value));
  if (keyframe.camera < 0 || keyframe.camera >= static_cast<int>(map.cameras.size()))
    problems.push_back(
        fmt::format("keyframe {}: camera {} does not exist", id.value, keyframe.camera));
  if (!keyframe.cam_from_world.IsValid())
    problems.push_back(fmt::format("keyframe {}: pose {}", id.value, kUnsound));
  if (map.retired.Contains(id))
    problems.push_back(fmt::format("keyframe {}: also retired", id.value));
  for (uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const LandmarkId landmark = keyframe.landmarks[i];
    if (!landmark.IsValid()) continue;
    const Landmark* seen = map.landmarks.Find(landmark);
    if (!seen ||
        std::ranges::find(seen->observations, Observation{id, i}) == seen->observations.end())
      problems.push_back(
          fmt::format("keyframe {}: landmark {} does not know it", id.value, landmark.value));
  }
  for (const Covisible& c : keyframe.covisible) {
    const Keyframe* other = map.keyframes.Find(c.keyframe);
    if (!other ||
        std::ranges::find(other->covisible, id, &Covisible::keyframe) == other->covisible.end())
      problems.push_back(fmt::format("keyframe {}: covisibility with {} is one-sided", id.value,
                                     c.keyframe.value));
  }
}

void CheckLandmark(const Map& map, LandmarkId id, const Landmark& landmark, Problems& problems) {
  if (!landmark.position.allFinite())
    problems.push_back(fmt::format("landmark {}: position not finite", id.value));
  if (landmark.observations.size() < 2)
    problems.push_back(fmt::format("landmark {}: fewer than two observations", id.value));
  for (size_t i = 0; i < landmark.observations.size(); ++i) {
    const Observation& o = landmark.observations[i];
    const Keyframe* by = map.keyframes.Find(o.keyframe);
    if (!by || o.keypoint >= by->landmarks.size() || by->landmarks[o.keypoint] != id)
      problems.push_back(
          fmt::format("landmark {}: keyframe {} does not know it", id.value, o.keyframe.value));
    if (i > 0 && landmark.observations[i - 1].keyframe >= o.keyframe)
      problems.push_back(fmt::format("landmark {}: observations not ascending", id.value));
  }
  if (id.value >= map.next_landmark)
    problems.push_back(fmt::format("landmark {}: id not allocated", id.value));
}

void CheckObject(const Map& map, ObjectId id, const Object& object, Problems& problems) {
  const Ellipsoid& e = object.ellipsoid;
  if (!e.center.allFinite() || !e.half_axes.allFinite() || !Rigid3::IsUnit(e.rotation))
    problems.push_back(fmt::format("object {}: ellipsoid {}", id.value, kUnsound));
  if (object.landmarks.size() != object.landmark_votes.size())
    problems.push_back(fmt::format("object {}: votes and landmarks differ in number", id.value));
  if (!std::ranges::is_sorted(object.landmarks))
    problems.push_back(fmt::format("object {}: landmarks not ascending", id.value));
  for (const ObjectObservation& o : object.observations) {
    if (!map.ResolvePose(o.reference))
      problems.push_back(fmt::format("object {}: reference keyframe {} leads nowhere", id.value,
                                     o.reference.value));
    if (!o.cam_from_reference.IsValid())
      problems.push_back(fmt::format("object {}: pose of an observation {}", id.value, kUnsound));
    if (o.camera < 0 || o.camera >= static_cast<int>(map.cameras.size()))
      problems.push_back(fmt::format("object {}: camera {} does not exist", id.value, o.camera));
  }
}

void CheckAnchor(const Map& map, const std::string& name, const Anchor& anchor,
                 Problems& problems) {
  if (!map.ResolvePose(anchor.keyframe))
    problems.push_back(
        fmt::format("anchor \"{}\": keyframe {} leads nowhere", name, anchor.keyframe.value));
  if (!anchor.cam_from_anchor.IsValid())
    problems.push_back(fmt::format("anchor \"{}\": pose {}", name, kUnsound));
  if (!(anchor.size > 0) || !std::isfinite(anchor.size))
    problems.push_back(fmt::format("anchor \"{}\": size {}, must be positive", name, anchor.size));
}

}  // namespace

bool Keyframe::HasSoundLearned() const {
  const LearnedDescriptors& learned = features->learned;
  return learned.descriptors.size() == learned.keypoints.size() &&
         learned_depths.size() == learned.keypoints.size() &&
         std::ranges::adjacent_find(learned.keypoints, std::ranges::greater_equal{}) ==
             learned.keypoints.end() &&
         (learned.empty() || learned.keypoints.back() < features->keypoints.size()) &&
         std::ranges::all_of(learned_depths, [](float z) { return std::isfinite(z) && z >= 0; });
}

std::vector<std::string> Map::CheckInvariants() const {
  Problems problems;
  keyframes.ForEach(
      [&](KeyframeId id, const Keyframe& k) { CheckKeyframe(*this, id, k, problems); });
  landmarks.ForEach(
      [&](LandmarkId id, const Landmark& l) { CheckLandmark(*this, id, l, problems); });
  retired.ForEach([&](KeyframeId id, const RetiredKeyframe& r) {
    if (!r.cam_from_parent.IsValid())
      problems.push_back(fmt::format("retired keyframe {}: pose {}", id.value, kUnsound));
    if (!ResolvePose(id))
      problems.push_back(fmt::format("retired keyframe {}: leads nowhere", id.value));
  });
  objects.ForEach([&](ObjectId id, const Object& o) { CheckObject(*this, id, o, problems); });
  for (const auto& [name, anchor] : anchors) CheckAnchor(*this, name, anchor, problems);
  return problems;
}

}  // namespace oaslam
