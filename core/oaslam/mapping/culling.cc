#include <algorithm>

#include "oaslam/mapping/local_mapping.h"

namespace oaslam {
namespace {

// Whether at least three other keyframes see the landmark at about the same level or a finer one.
bool SeenElsewhere(const Map& map, const Landmark& landmark, KeyframeId except, int octave) {
  constexpr int kOthers = 3;  // so that three views still constrain the landmark
  int count = 0;
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == except) continue;
    const Keyframe& other = map.keyframes.At(o.keyframe);
    if (other.features->keypoints[o.keypoint].octave <= octave + 1 && ++count >= kOthers)
      return true;
  }
  return false;
}

bool IsRedundant(const Map& map, KeyframeId id, double share) {
  const Keyframe& keyframe = map.keyframes.At(id);
  int total = 0, redundant = 0;
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].IsValid()) continue;
    ++total;
    redundant += SeenElsewhere(map, map.landmarks.At(keyframe.landmarks[i]), id,
                               keyframe.features->keypoints[i].octave);
  }
  return total > 0 && redundant > share * total;
}

}  // namespace

std::vector<LandmarkId> CullRecentLandmarks(std::span<const LandmarkId> recent, KeyframeId newest,
                                            Map& map) {
  // Of the frames that should show it; wrong landmarks are seldom found.
  constexpr double kMinFoundRatio = 0.25;
  constexpr size_t kMinObservations = 3;  // keyframes: two define a point, a third confirms it
  constexpr uint32_t kTrial = 3;          // keyframes for which a new landmark is on trial
  std::vector<LandmarkId> watched;
  for (const LandmarkId id : recent) {
    const Landmark* landmark = map.landmarks.Find(id);
    if (!landmark) continue;
    const uint32_t age = newest.value - landmark->first_keyframe.value;  // in keyframes
    if (landmark->found < kMinFoundRatio * landmark->visible ||
        (age >= 2 && landmark->observations.size() < kMinObservations))
      map.EraseLandmark(id);
    else if (age < kTrial)
      watched.push_back(id);
  }
  return watched;
}

void CullKeyframes(KeyframeId keyframe, Map& map) {
  constexpr double kRedundancy = 0.9;  // share of its landmarks that the others see
  const KeyframeId first = map.keyframes.First();
  std::vector<KeyframeId> neighbours =
      map.CovisibleKeyframes(keyframe, static_cast<int>(map.keyframes.size()));
  std::ranges::sort(neighbours);
  for (const KeyframeId id : neighbours) {
    // The newest keyframes may still be the tracker's reference, and the first one defines the
    // frame of the map.
    if (id != first && id.value + 2 <= keyframe.value && IsRedundant(map, id, kRedundancy))
      map.RetireKeyframe(id);
  }
}

std::vector<KeyframeId> PackSettledKeyframes(std::vector<KeyframeId> unsettled, Map& map) {
  // A flat has some hundred; with 30, accuracy may suffer (docs/lab/speed.md).
  constexpr size_t kUnsettled = 500;
  std::erase_if(unsettled, [&](KeyframeId id) { return !map.keyframes.Contains(id); });
  const size_t settled = unsettled.size() - std::min(unsettled.size(), kUnsettled);
  for (size_t i = 0; i < settled; ++i) map.DropFreeKeypoints(unsettled[i]);
  unsettled.erase(unsettled.begin(), unsettled.begin() + static_cast<std::ptrdiff_t>(settled));
  return unsettled;
}

}  // namespace oaslam
