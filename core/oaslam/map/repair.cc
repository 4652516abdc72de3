#include "oaslam/map/repair.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace oaslam {
namespace {

bool IsUsable(const Keyframe& keyframe, const Map& map) {
  return keyframe.features && keyframe.landmarks.size() == keyframe.features->keypoints.size() &&
         keyframe.camera >= 0 && keyframe.camera < static_cast<int>(map.cameras.size()) &&
         keyframe.cam_from_world.IsValid();
}

bool Knows(const Keyframe* keyframe, uint32_t keypoint, LandmarkId landmark) {
  return keyframe && keypoint < keyframe->landmarks.size() &&
         keyframe->landmarks[keypoint] == landmark;
}

void RepairKeyframes(Map& map) {
  for (const KeyframeId id : map.keyframes.Ids()) {
    const Keyframe& keyframe = map.keyframes.At(id);
    if (!IsUsable(keyframe, map)) {
      map.keyframes.Erase(id);
      continue;
    }
    map.retired.Erase(id);
    if (keyframe.HasSoundLearned()) continue;
    Features without = *keyframe.features;
    without.learned = {};
    Keyframe& repaired = map.keyframes.MutableAt(id);
    repaired.features = std::make_shared<const Features>(std::move(without));
    repaired.learned_depths.clear();
  }
  for (const KeyframeId id : map.retired.Ids())
    if (!map.retired.At(id).cam_from_parent.IsValid()) map.retired.Erase(id);
  for (const KeyframeId id : map.retired.Ids())
    if (!map.ResolvePose(id)) map.retired.Erase(id);
}

// Keeps the observations that both sides know.
void RepairObservations(Map& map) {
  for (const LandmarkId id : map.landmarks.Ids()) {
    Landmark& landmark = map.landmarks.MutableAt(id);
    auto& observations = landmark.observations;
    std::erase_if(observations, [&](const Observation& o) {
      return !Knows(map.keyframes.Find(o.keyframe), o.keypoint, id);
    });
    std::ranges::stable_sort(observations, {}, &Observation::keyframe);
    const auto repeats = std::ranges::unique(observations, {}, &Observation::keyframe);
    observations.erase(repeats.begin(), repeats.end());
    if (observations.size() < 2 || !landmark.position.allFinite()) {
      map.landmarks.Erase(id);
      continue;
    }
    map.next_landmark = std::max(map.next_landmark, id.value + 1);
  }
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.MutableAt(id);
    for (uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const Landmark* seen =
          keyframe.landmarks[i].IsValid() ? map.landmarks.Find(keyframe.landmarks[i]) : nullptr;
      const Observation own{id, i};
      if (!seen || std::ranges::find(seen->observations, own) == seen->observations.end())
        keyframe.landmarks[i] = LandmarkId();
    }
  }
}

void RepairCovisibility(Map& map) {
  const auto knows = [&](KeyframeId keyframe, KeyframeId other) {
    const Keyframe* k = map.keyframes.Find(keyframe);
    return k && std::ranges::find(k->covisible, other, &Covisible::keyframe) != k->covisible.end();
  };
  for (const KeyframeId id : map.keyframes.Ids())
    std::erase_if(map.keyframes.MutableAt(id).covisible,
                  [&](const Covisible& c) { return !knows(c.keyframe, id); });
}

// Sorts the landmarks with their votes; removes all if their numbers differ, since it is unknown
// which vote belongs to which.
void RepairVotes(Object& object) {
  if (object.landmarks.size() != object.landmark_votes.size()) {
    object.landmarks.clear();
    object.landmark_votes.clear();
  }
  if (std::ranges::is_sorted(object.landmarks)) return;
  std::vector<size_t> order(object.landmarks.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t i) { return object.landmarks[i]; });
  const std::vector<LandmarkId> landmarks = object.landmarks;
  const std::vector<uint16_t> votes = object.landmark_votes;
  for (size_t i = 0; i < order.size(); ++i) {
    object.landmarks[i] = landmarks[order[i]];
    object.landmark_votes[i] = votes[order[i]];
  }
}

void RepairObjects(Map& map) {
  for (const ObjectId id : map.objects.Ids()) {
    Object& object = map.objects.MutableAt(id);
    const Ellipsoid& e = object.ellipsoid;
    if (!e.center.allFinite() || !e.half_axes.allFinite() || !Rigid3::IsUnit(e.rotation)) {
      map.objects.Erase(id);
      continue;
    }
    RepairVotes(object);
    std::erase_if(object.observations, [&](const ObjectObservation& o) {
      return !map.ResolvePose(o.reference) || !o.cam_from_reference.IsValid() || o.camera < 0 ||
             o.camera >= static_cast<int>(map.cameras.size());
    });
  }
}

void RepairAnchors(Map& map) {
  std::erase_if(map.anchors, [&](const auto& entry) {
    const Anchor& anchor = entry.second;
    return !map.ResolvePose(anchor.keyframe) || !(anchor.size > 0) || !std::isfinite(anchor.size) ||
           !anchor.cam_from_anchor.IsValid();
  });
}

}  // namespace

Map Repaired(const Map& map) {
  Map repaired = map;
  RepairKeyframes(repaired);
  RepairObservations(repaired);
  RepairCovisibility(repaired);
  RepairObjects(repaired);
  RepairAnchors(repaired);
  return repaired;
}

}  // namespace oaslam
