#include "oaslam/relocalization/place_matching.h"

#include <algorithm>

#include "oaslam/map/landmark_sets.h"
#include "oaslam/matching/orientation_check.h"

namespace oaslam {
namespace {

// Loose bounds, since what is wrong among mutual matches is found by geometry: the largest
// distance, and the largest ratio of it to that of the nearest other landmark.
constexpr int kMaxHamming = 80;
constexpr double kRatio = 0.9;

// How the keyframes of a place show its landmarks; a structure of arrays.
struct Views {
  std::vector<LandmarkId> landmarks;  // of the place, ascending
  std::vector<int> landmark;          // by view: index into `landmarks`
  std::vector<Descriptor> descriptor;
  std::vector<float> angle_rad;

  Views(const Map& map, const Place& place) : landmarks(LandmarksSeenBy(map, place.keyframes)) {
    for (const KeyframeId id : place.keyframes) {
      const Keyframe& keyframe = map.keyframes.At(id);
      for (size_t k = 0; k < keyframe.landmarks.size(); ++k) {
        if (!keyframe.landmarks[k].IsValid()) continue;
        const auto at = std::ranges::lower_bound(landmarks, keyframe.landmarks[k]);
        landmark.push_back(static_cast<int>(at - landmarks.begin()));
        descriptor.push_back(keyframe.features->descriptors[k]);
        angle_rad.push_back(keyframe.features->keypoints[k].angle_rad);
      }
    }
  }
};

struct Nearest {
  int distance = kMaxHamming + 1;
  int of = -1;
};

}  // namespace

std::vector<PlaceMatch> MatchPlace(const Features& features, const Map& map, const Place& place) {
  const Views views(map, place);
  std::vector<Nearest> keypoint_of(views.landmarks.size());
  std::vector<Nearest> view_of(features.keypoints.size());
  for (int k = 0; k < features.size(); ++k) {
    Nearest& best = view_of[k];
    int other = 2 * kMaxHamming;  // distance of the nearest view of another landmark
    for (size_t v = 0; v < views.descriptor.size(); ++v) {
      const int distance = HammingDistance(features.descriptors[k], views.descriptor[v]);
      if (Nearest& near = keypoint_of[views.landmark[v]]; distance < near.distance)
        near = {distance, k};
      if (distance >= other) continue;
      const bool is_same = best.of >= 0 && views.landmark[v] == views.landmark[best.of];
      if (distance < best.distance) {
        if (!is_same && best.of >= 0) other = best.distance;
        best = {distance, static_cast<int>(v)};
      } else if (!is_same) {
        other = distance;
      }
    }
    if (best.distance >= kRatio * other) best.of = -1;
  }
  std::vector<PlaceMatch> mutual;
  std::vector<float> turns;
  for (int k = 0; k < features.size(); ++k) {
    const Nearest& best = view_of[k];
    if (best.of < 0 || keypoint_of[views.landmark[best.of]].of != k) continue;
    mutual.push_back({k, views.landmarks[views.landmark[best.of]], best.distance});
    turns.push_back(views.angle_rad[best.of] - features.keypoints[k].angle_rad);
  }
  const std::vector<char> consistent = ConsistentOrientations(turns);
  std::vector<PlaceMatch> kept;
  for (size_t i = 0; i < mutual.size(); ++i)
    if (consistent[i]) kept.push_back(mutual[i]);
  std::ranges::stable_sort(kept, {}, &PlaceMatch::distance);
  return kept;
}

}  // namespace oaslam
