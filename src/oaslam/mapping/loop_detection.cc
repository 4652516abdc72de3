#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "oaslam/estimation/absolute_pose.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/mapping/loop_objects.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/matching/projection_search.h"
#include "oaslam/util/id_set.h"
#include "oaslam/util/log.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr double kMaxDistanceToDepth = 0.5;
constexpr double kMinAxisCos = 0.8;
constexpr uint32_t kMinKeyframesApart = 15;
constexpr int kMaxCandidates = 3, kGroupSize = 8;
constexpr int kMinMatches = 20, kMinRansacInliers = 15, kMinInliers = 50, kMinScalePairs = 10;
constexpr double kGuidedRadiusPx = 8;

KeyframePlace PlaceOf(KeyframeId id, const Keyframe& keyframe) {
  return {id, keyframe.cam_from_world.OriginInSource(),
          keyframe.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ()};
}

// Decides whether a keyframe may be the other end of a loop: it is old enough, and not linked with
// the current one by two steps in the covisibility graph.
class OtherEnds {
 public:
  OtherEnds(const Map& map, KeyframeId current) : current_(current) {
    for (const Covisible& c : map.keyframes.At(current).covisible) {
      linked_.Insert(c.keyframe);
      for (const Covisible& second : map.keyframes.At(c.keyframe).covisible)
        linked_.Insert(second.keyframe);
    }
  }
  bool Contains(KeyframeId id) const {
    return id.value + kMinKeyframesApart <= current_.value && !linked_.Contains(id);
  }

 private:
  KeyframeId current_;
  IdSet<KeyframeId> linked_;
};

// The keyframes near the current one among those that `is_candidate` accepts, nearest first.
template <typename Predicate>
std::vector<KeyframeId> NearInSpace(const Map& map, std::span<const KeyframePlace> places,
                                    KeyframeId current, Predicate&& is_candidate) {
  const double reach = kMaxDistanceToDepth * map.MedianDepth(current);
  const KeyframePlace here = PlaceOf(current, map.keyframes.At(current));
  std::vector<std::pair<double, KeyframeId>> near;
  for (const KeyframePlace& there : places) {
    const double distance = (there.center - here.center).norm();
    if (distance < reach && here.axis.dot(there.axis) >= kMinAxisCos && is_candidate(there.id))
      near.emplace_back(distance, there.id);
  }
  std::ranges::sort(near);
  std::vector<KeyframeId> ids;
  for (const auto& [distance, id] : near)
    if (static_cast<int>(ids.size()) < kMaxCandidates) ids.push_back(id);
  return ids;
}

struct Observed {
  std::vector<PointObservation> points;
  std::vector<uint32_t> keypoints;  // parallel
};

Observed Observe(const Map& map, const Keyframe& by, const std::vector<LandmarkId>& matches) {
  Observed observed;
  for (uint32_t k = 0; k < matches.size(); ++k) {
    if (!matches[k].IsValid()) continue;
    observed.points.push_back(
        ObservationOf(*by.features, static_cast<int>(k), map.landmarks.At(matches[k])));
    observed.keypoints.push_back(k);
  }
  return observed;
}

// Key points that show a landmark of the current part and one of the old part:
// the positions of both.
std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> SharedPoints(const Map& map,
                                                                      const Keyframe& here,
                                                                      const LoopClosure& loop) {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> shared;
  for (const auto& [keypoint, old] : loop.old_landmarks)
    if (const Landmark* current = here.landmarks[keypoint].IsValid()
                                      ? map.landmarks.Find(here.landmarks[keypoint])
                                      : nullptr)
      shared.emplace_back(current->position, map.landmarks.At(old).position);
  return shared;
}

// The scale of the old part relative to the current one: the median ratio of the distances to
// shared points; nothing where there are too few.
std::optional<double> ScaleOf(
    const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& shared,
    const Rigid3& cam_from_current, const Rigid3& cam_from_old) {
  if (static_cast<int>(shared.size()) < kMinScalePairs) return std::nullopt;
  std::vector<double> ratios;
  for (const auto& [current, old] : shared)
    ratios.push_back((cam_from_old * old).norm() / (cam_from_current * current).norm());
  return Median(std::move(ratios));
}

// Counts the shared points that the loop's similarity brings together, with an error relative to
// their distance.
int CountConsistent(const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& shared,
                    const Similarity& old_from_current, const Rigid3& cam_from_old) {
  constexpr double kMaxRelativeError = 0.1;
  return static_cast<int>(std::ranges::count_if(shared, [&](const auto& pair) {
    return (old_from_current * pair.first - pair.second).norm() <
           kMaxRelativeError * (cam_from_old * pair.second).norm();
  }));
}

// The length of the camera's path between two keyframes.
double PathLength(const Map& map, KeyframeId a, KeyframeId b) {
  const auto [from, to] = std::minmax(a, b);
  double length = 0;
  std::optional<Eigen::Vector3d> before;
  for (KeyframeId id = from; id <= to; ++id.value) {
    const Keyframe* keyframe = map.keyframes.Find(id);
    if (!keyframe) continue;
    const Eigen::Vector3d center = keyframe->cam_from_world.OriginInSource();
    if (before) length += (center - *before).norm();
    before = center;
  }
  return length;
}

// How far the loop's correction moves the camera of its current keyframe.
double DistanceMoved(const Map& map, const LoopClosure& loop) {
  const Eigen::Vector3d center = map.keyframes.At(loop.current).cam_from_world.OriginInSource();
  return (loop.old_from_current * center - center).norm();
}

bool IsWithin(const Similarity& correction, double max_angle, double max_scale) {
  return correction.rotation.angularDistance(Eigen::Quaterniond::Identity()) < max_angle &&
         std::abs(std::log(correction.scale)) < std::log(max_scale);
}

// Whether drift explains the correction: drift is a share of the path travelled. A larger
// correction means that two different places look the same, such as two windows.
bool IsDrift(const Map& map, const LoopClosure& loop) {
  constexpr double kMaxShare = 0.25, kMaxAngle = 0.6, kMaxScale = 2.5;
  return DistanceMoved(map, loop) < kMaxShare * PathLength(map, loop.old, loop.current) &&
         IsWithin(loop.old_from_current, kMaxAngle, kMaxScale);
}

bool IsBelieved(const Map& map, const LoopClosure& loop) {
  if (!IsDrift(map, loop)) return false;
  const LoopObjects objects = CompareObjects(map, loop);
  Log(LogLevel::kDebug,
      fmt::format("loop from keyframe {} to {} by {} landmarks: {} objects agree, {} contradict",
                  loop.current.value, loop.old.value, loop.old_landmarks.size(), objects.agreeing,
                  objects.contradicting));
  return !AreObjectsAgainst(objects);
}

// Whether the correction is as small as the error with which the pieces were joined.
bool IsSmall(const Map& map, const LoopClosure& tie) {
  constexpr double kMaxAngle = 0.3, kMaxScale = 1.3;
  return DistanceMoved(map, tie) < kMaxDistanceToDepth * map.MedianDepth(tie.old) &&
         IsWithin(tie.old_from_current, kMaxAngle, kMaxScale);
}

std::optional<LoopClosure> Verify(const Map& map, KeyframeId current, KeyframeId old, bool is_near,
                                  Rng& rng) {
  const Keyframe& here = map.keyframes.At(current);
  const Camera& camera = map.cameras[here.camera];
  const LandmarkMatches matches =
      MatchKeyframeLandmarks(*here.features, map, map.keyframes.At(old), 0.75);
  if (matches.count < kMinMatches) return std::nullopt;
  AbsolutePoseOptions options;
  options.min_inliers = kMinRansacInliers;
  const AbsolutePoseReport rough =
      EstimateAbsolutePose(camera, Observe(map, here, matches.landmarks).points, options, rng);
  if (!rough.success) return std::nullopt;

  std::vector<KeyframeId> group = map.CovisibleKeyframes(old, kGroupSize);
  group.push_back(old);
  std::vector<ProjectedLandmark> projected;
  for (const LandmarkId id : LandmarksSeenBy(map, group))
    if (const auto p =
            ProjectLandmark(id, map.landmarks.At(id), camera, rough.cam_from_world, *here.features))
      projected.push_back(*p);
  ProjectionSearchOptions search;
  search.radius_px = kGuidedRadiusPx;
  const LandmarkMatches guided =
      SearchByProjection(*here.features, map, projected,
                         std::vector<LandmarkId>(here.features->keypoints.size()), search);
  const Observed observed = Observe(map, here, guided.landmarks);
  const PoseReport pose = RefinePose(camera, rough.cam_from_world, observed.points);
  if (!pose.success || pose.inliers < kMinInliers) return std::nullopt;

  LoopClosure loop{current, old, {}, {}};
  for (size_t i = 0; i < observed.keypoints.size(); ++i)
    if (pose.inlier[i])
      loop.old_landmarks.emplace_back(observed.keypoints[i],
                                      guided.landmarks[observed.keypoints[i]]);
  const auto shared = SharedPoints(map, here, loop);
  const std::optional<double> scale = ScaleOf(shared, here.cam_from_world, pose.cam_from_world);
  if (!scale && !is_near) return std::nullopt;
  // Both poses are of one camera: s (R_current x + t_current) = R_old x' + t_old.
  loop.old_from_current =
      Similarity(pose.cam_from_world.Inverse()) *
      Similarity(scale.value_or(1), Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()) *
      Similarity(here.cam_from_world);
  if (!is_near && CountConsistent(shared, loop.old_from_current, pose.cam_from_world) <
                      std::max(kMinScalePairs, static_cast<int>(shared.size()) / 2))
    return std::nullopt;
  return loop;
}

}  // namespace

void LoopDetector::UpdateIndex(const Map& map, KeyframeId current) {
  // The index is made anew when the landmarks have grown by this factor; the newest do not matter
  // for a loop.
  constexpr double kGrowth = 1.2;
  constexpr size_t kLarge = 30000;  // landmarks; an index of fewer takes some 30 ms
  constexpr uint32_t kKeyframesToMakeIt = 30;
  if (next_index_.valid() && current.value >= next_begun_at_.value + kKeyframesToMakeIt) {
    index_ = next_index_.get();
  }
  if (next_index_.valid() || (index_ && map.next_landmark <= kGrowth * indexed_up_to_)) return;
  indexed_up_to_ = map.next_landmark;
  if (map.landmarks.size() < kLarge) {
    index_.emplace(map);
    return;
  }
  next_begun_at_ = current;
  next_index_ = std::async(std::launch::async, [map] { return PlaceIndex(map); });
}

std::vector<Place> LoopDetector::LookingAlike(const Map& map, KeyframeId current) {
  constexpr uint32_t kEvery = 3;  // keyframes: a place stays in view for several
  if (map.keyframes.size() < 2 * kMinKeyframesApart || current.value % kEvery != 0) return {};
  UpdateIndex(map, current);
  if (!index_) return {};
  return index_->RankPlaces(map, index_->Find(*map.keyframes.At(current).features),
                            std::numeric_limits<int>::max());
}

// Looks only at keyframes that may have changed since the last call.
void LoopDetector::UpdatePlaces(const Map& map) {
  map.keyframes.ForEachDifference(known_, [&](KeyframeId id, const Keyframe*, const Keyframe* now) {
    const auto at = std::ranges::lower_bound(places_, id, {}, &KeyframePlace::id);
    const bool is_known = at != places_.end() && at->id == id;
    if (!now) {
      if (is_known) places_.erase(at);
    } else if (is_known) {
      *at = PlaceOf(id, *now);
    } else {
      places_.insert(at, PlaceOf(id, *now));
    }
  });
  known_ = map.keyframes;
}

std::optional<LoopClosure> LoopDetector::Detect(const Map& map, KeyframeId current, Rng& rng) {
  if (!map.keyframes.Contains(current)) return std::nullopt;
  UpdatePlaces(map);
  const OtherEnds others(map, current);
  const std::vector<KeyframeId> near =
      NearInSpace(map, places_, current, [&](KeyframeId id) { return others.Contains(id); });
  for (const KeyframeId old : near)
    if (auto loop = Verify(map, current, old, true, rng); loop && IsBelieved(map, *loop))
      return loop;
  int tried = 0;
  for (const Place& place : LookingAlike(map, current)) {
    const KeyframeId old = place.keyframes.front();
    if (!others.Contains(old)) continue;
    if (++tried > kMaxCandidates) break;
    if (std::ranges::find(near, old) != near.end()) continue;
    if (auto loop = Verify(map, current, old, false, rng); loop && IsBelieved(map, *loop))
      return loop;
  }
  return std::nullopt;
}

std::optional<LoopClosure> FindTie(const Map& map, KeyframeId current,
                                   const std::set<KeyframeId>& others, Rng& rng) {
  std::vector<KeyframePlace> places;
  for (const KeyframeId id : others)
    if (const Keyframe* keyframe = map.keyframes.Find(id)) places.push_back(PlaceOf(id, *keyframe));
  for (const KeyframeId old : NearInSpace(map, places, current, [](KeyframeId) { return true; }))
    if (auto tie = Verify(map, current, old, true, rng); tie && IsSmall(map, *tie)) return tie;
  return std::nullopt;
}

}  // namespace oaslam
