#include "oaslam/mapping/loop_verification.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "oaslam/matching/place_search.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// The values of this file were chosen by these reasons, not measured.
constexpr int kRansacIterations = 900;  // as for a lost camera
// A wrong loop destroys the map, while a missed one is found by a later keyframe: as many inliers
// as kMinRelocalizationInliers, and fewer doubts than of a lost camera's pose.
constexpr int kMinInliers = 50;
constexpr double kMinConfidence = 0.99;
// Where the objects around both ends agree, too, half of the points suffice.
constexpr int kMinInliersByObjects = 25;
constexpr double kMinConfidenceByObjects = 0.5;
constexpr int kMinScalePairs = 10;  // a median of fewer ratios may be that of wrong ones

// Key points that show a landmark of the current part and one of the old part:
// the positions of both.
std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> SharedPoints(const Map& map,
                                                                      const Keyframe& here,
                                                                      const LoopClosure& loop) {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> shared;
  for (const auto& [keypoint, old] : loop.old_landmarks)
    if (const Landmark* current = map.landmarks.Find(here.landmarks[keypoint]))
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
  constexpr double kMaxRelativeError = 0.1;  // the error of depth from few views
  return static_cast<int>(std::ranges::count_if(shared, [&](const auto& pair) {
    return (old_from_current * pair.first - pair.second).norm() <
           kMaxRelativeError * (cam_from_old * pair.second).norm();
  }));
}

// Whether the poses from points and from objects agree within the accuracy of objects.
bool AreAlike(const Rigid3& by_points, const Rigid3& by_objects, double depth) {
  constexpr double kMaxAngle = 0.2, kMaxDistance = 0.2;  // rad; of the depth
  return by_points.rotation.angularDistance(by_objects.rotation) < kMaxAngle &&
         (by_points.OriginInSource() - by_objects.OriginInSource()).norm() < kMaxDistance * depth;
}

}  // namespace

Rigid3 MovedCamera(const Keyframe& keyframe, const Similarity& old_from_current) {
  return (Similarity(keyframe.cam_from_world) * old_from_current.Inverse()).AsPose();
}

std::optional<LoopClosure> VerifyLoop(const Map& map, KeyframeId current,
                                      const LoopCandidate& candidate, Rng& rng) {
  // Around projections by a pose from objects, which is less accurate.
  constexpr double kRadiusByObjectsPx = 32;
  const PlaceSearchOptions options{kRansacIterations,
                                   candidate.by_objects ? kMinConfidenceByObjects : kMinConfidence};
  const KeyframeId old = candidate.old;
  const Keyframe& here = map.keyframes.At(current);
  Frame frame;
  frame.camera = std::make_shared<const Camera>(map.cameras[static_cast<size_t>(here.camera)]);
  frame.features = here.features;
  std::optional<Relocalization> found =
      FindAtPlace(frame, map, PlaceAround(map, old), Appearance::kOrb, options, rng);
  if (candidate.by_objects) {
    const double depth = map.MedianDepth(old);
    const Rigid3 expected = MovedCamera(here, *candidate.by_objects);
    const auto is_confirmed = [&] {
      return found && found->IsFound() && AreAlike(found->cam_from_world, expected, depth);
    };
    if (!is_confirmed())
      found = FindNear(frame, map, LandmarksAround(map, old), expected, kRadiusByObjectsPx, options,
                       rng);
    if (!is_confirmed()) return std::nullopt;
  }
  if (!found || !found->IsFound() ||
      found->points.inliers < (candidate.by_objects ? kMinInliersByObjects : kMinInliers))
    return std::nullopt;

  LoopClosure loop{current, old, {}, {}};
  const std::vector<LandmarkId>& landmarks = found->points.landmarks;
  for (int k = 0; k < static_cast<int>(landmarks.size()); ++k)
    if (landmarks[k].IsValid()) loop.old_landmarks.emplace_back(k, landmarks[k]);
  const auto shared = SharedPoints(map, here, loop);
  std::optional<double> scale = ScaleOf(shared, here.cam_from_world, found->cam_from_world);
  const bool is_scale_by_points = scale.has_value();
  if (!scale && candidate.by_objects) scale = candidate.by_objects->scale;
  if (!scale && !candidate.is_near) return std::nullopt;
  loop.is_scale_known = scale.has_value();
  // Both poses are of the same camera: s (R_current x + t_current) = R_old x' + t_old.
  loop.old_from_current =
      Similarity(found->cam_from_world.Inverse()) *
      Similarity(scale.value_or(1), Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()) *
      Similarity(here.cam_from_world);
  if (!candidate.is_near && is_scale_by_points &&
      CountConsistent(shared, loop.old_from_current, found->cam_from_world) <
          std::max(kMinScalePairs, static_cast<int>(shared.size()) / 2))  // at least half of them
    return std::nullopt;
  return loop;
}

}  // namespace oaslam
