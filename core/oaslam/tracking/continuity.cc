#include "oaslam/tracking/continuity.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "oaslam/matching/place_search.h"
#include "oaslam/matching/plane_support.h"

namespace oaslam {
namespace {

struct Passed {
  int frame_index = 0;
  double time = 0;
  Rigid3 cam_from_world;
  double depth = 0;  // median depth of the reference keyframe's landmarks
  bool is_other = false;
};

void Append(const Map& map, std::span<const FramePose> trajectory, const Similarity& world_from_map,
            bool is_other, std::vector<Passed>& way) {
  KeyframeId nearest;  // successive frames mostly have the same
  double depth = 0;
  for (const FramePose& frame : trajectory) {
    const auto reference = frame.state == TrackingState::kObjects
                               ? std::nullopt
                               : map.ResolveKeyframe(frame.reference);
    if (!reference) continue;
    if (reference->by != nearest) depth = map.MedianDepth(reference->by);
    nearest = reference->by;
    const Rigid3 cam_from_map = frame.cam_from_reference * reference->cam_from_carrier *
                                map.keyframes.At(reference->by).cam_from_world;
    way.push_back({frame.frame_index, frame.timestamp,
                   (Similarity(cam_from_map) * world_from_map.Inverse()).AsPose(),
                   world_from_map.scale * depth, is_other});
  }
}

struct Step {
  double seconds = 0, distance = 0, angle = 0;
};

Step StepBetween(const Passed& a, const Passed& b) {
  return {b.time - a.time,
          (a.cam_from_world.OriginInSource() - b.cam_from_world.OriginInSource()).norm(),
          a.cam_from_world.rotation.angularDistance(b.cam_from_world.rotation)};
}

double NinetyFifth(std::vector<double> values) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 95 / 100);
  std::ranges::nth_element(values, place);
  return *place;
}

// Whether the map is of one wall or table, so that there is no other place.
bool ShowsOneWall(const Map& map) {
  constexpr size_t kMost = 2000;  // landmarks that are looked at, which bounds the time
  if (map.keyframes.empty()) return false;
  const std::vector<LandmarkId> ids = map.landmarks.Ids();
  std::vector<Eigen::Vector3d> landmarks;
  for (size_t i = 0; i < ids.size(); i += ids.size() / kMost + 1)
    landmarks.push_back(map.landmarks.At(ids[i]).position);
  return IsOneWall(landmarks, map.MedianDepth(map.keyframes.First()));
}

}  // namespace

std::span<const FramePose> NewestPoses(const std::vector<FramePose>& trajectory, double now) {
  constexpr double kSeconds = 60;
  auto first = trajectory.end();
  while (first != trajectory.begin() && std::prev(first)->timestamp >= now - kSeconds) --first;
  return {first, trajectory.end()};
}

bool TellsPlace(const Map& map, const Map& from, const Relocalization& found,
                double seconds_since_seen) {
  constexpr size_t kObjects = 3;  // that agree with the pose are no window
  const bool is_soon = seconds_since_seen >= 0 && seconds_since_seen <= kLongestStep;
  return found.evidence != PoseEvidence::kPoints || is_soon ||
         found.objects.matched.size() >= kObjects || !IsFlat(map, found) ||
         (ShowsOneWall(map) && ShowsOneWall(from));
}

bool IsContinuous(const Map& map, std::span<const FramePose> trajectory, const Map& other,
                  std::span<const FramePose> other_trajectory, const Similarity& world_from_other) {
  constexpr double kMaxTimes = 2;  // faster than within the submaps
  constexpr double kHandTurn = 3,
                   kHandSpeed = 1;  // that a hand is always capable of: rad/s, depths/s
  const auto is_step = [](const Step& step) {
    return step.seconds > 0 && step.seconds <= kLongestStep;
  };
  // The error of the alignment of the submaps, as a share of the depth and in rad.
  constexpr double kTolerance = 0.03;
  std::vector<Passed> way;
  Append(map, trajectory, Similarity(), false, way);
  Append(other, other_trajectory, world_from_other, true, way);
  // Of frames that both submaps have, the pose in `map` is kept: the sort is
  // stable and it comes first.
  std::ranges::stable_sort(way, {}, &Passed::frame_index);
  const auto doubled = std::ranges::unique(way, {}, &Passed::frame_index);
  way.erase(doubled.begin(), doubled.end());
  std::vector<double> speeds, turns;
  for (size_t i = 1; i < way.size(); ++i) {
    const Step step = StepBetween(way[i - 1], way[i]);
    if (way[i - 1].is_other != way[i].is_other || !is_step(step)) continue;
    speeds.push_back(step.distance / step.seconds);
    turns.push_back(step.angle / step.seconds);
  }
  if (speeds.empty()) return true;
  const double max_speed = kMaxTimes * NinetyFifth(std::move(speeds)),
               max_turn = std::max(kHandTurn, kMaxTimes * NinetyFifth(std::move(turns)));
  for (size_t i = 1; i < way.size(); ++i) {
    const Step step = StepBetween(way[i - 1], way[i]);
    if (way[i - 1].is_other == way[i].is_other || !is_step(step)) continue;
    const double depth = std::min(way[i - 1].depth, way[i].depth);
    const double max_distance =
        std::max(max_speed, kHandSpeed * depth) * step.seconds + kTolerance * depth;
    if (step.distance > max_distance || step.angle > max_turn * step.seconds + kTolerance)
      return false;
  }
  return true;
}

}  // namespace oaslam
