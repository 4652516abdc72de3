#include "oaslam/mapping/loop_verification.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "oaslam/estimation/absolute_pose.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/matching/projection_search.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// The values of this file were chosen by these reasons, not measured.
constexpr int kGroupSize = 8;  // keyframes around an end, which see most of its landmarks
// A wrong loop destroys the map, while a missed one is found by a later keyframe: as many inliers
// as tracking.min_relocalization_inliers. The first pose needs fewer, since it only guides the
// search for these.
constexpr int kMinInliers = 50, kMinMatches = 20, kMinRansacInliers = 15;
// Where the objects around both ends agree, too, half of the points suffice.
constexpr int kMinInliersByObjects = 25;
constexpr int kMinScalePairs = 10;     // a median of fewer ratios may be that of wrong ones
constexpr double kGuidedRadiusPx = 8;  // the error of a pose by RANSAC

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

LandmarkMatches SearchAbout(const Map& map, std::span<const LandmarkId> landmarks,
                            const Keyframe& here, const Rigid3& cam_from_world, double radius_px) {
  std::vector<ProjectedLandmark> projected;
  for (const LandmarkId id : landmarks)
    if (const auto p = ProjectLandmark(id, map.landmarks.At(id), map.cameras[here.camera],
                                       cam_from_world, *here.features))
      projected.push_back(*p);
  ProjectionSearchOptions search;
  search.radius_px = radius_px;
  return SearchByProjection(*here.features, map, projected,
                            std::vector<LandmarkId>(here.features->keypoints.size()), search);
}

// The pose of `here` by points that it has in common with the other end.
std::optional<Rigid3> PoseByMatches(const Map& map, const Keyframe& here,
                                    const LandmarkMatches& matches, Rng& rng) {
  if (matches.count < kMinMatches) return std::nullopt;
  AbsolutePoseOptions options;
  options.min_inliers = kMinRansacInliers;
  const AbsolutePoseReport pose = EstimateAbsolutePose(
      map.cameras[here.camera], ObserveMatches(*here.features, map, matches.landmarks).observations,
      options, rng);
  if (!pose.success) return std::nullopt;
  return pose.cam_from_world;
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
  // Stricter than where a lost camera is looked for, since a wrong loop destroys the map.
  constexpr double kRatio = 0.75;
  const KeyframeId old = candidate.old;
  const Keyframe& here = map.keyframes.At(current);
  const Camera& camera = map.cameras[here.camera];
  const auto group_landmarks = [&] {
    return LandmarksSeenBy(map, map.KeyframesAround(old, kGroupSize));
  };
  std::optional<Rigid3> rough = PoseByMatches(
      map, here, MatchKeyframeLandmarks(*here.features, map, map.keyframes.At(old), kRatio), rng);
  std::optional<Rigid3> expected;
  if (candidate.by_objects) {
    const double depth = map.MedianDepth(old);
    expected = MovedCamera(here, *candidate.by_objects);
    if (!rough || !AreAlike(*rough, *expected, depth))
      rough = PoseByMatches(
          map, here, SearchAbout(map, group_landmarks(), here, *expected, kRadiusByObjectsPx), rng);
    if (rough && !AreAlike(*rough, *expected, depth)) return std::nullopt;
  }
  if (!rough) return std::nullopt;

  const LandmarkMatches guided = SearchAbout(map, group_landmarks(), here, *rough, kGuidedRadiusPx);
  const MatchedPoints observed = ObserveMatches(*here.features, map, guided.landmarks);
  const PoseReport pose = RefinePose(camera, *rough, observed.observations);
  if (!pose.success || pose.inliers < (expected ? kMinInliersByObjects : kMinInliers))
    return std::nullopt;

  LoopClosure loop{current, old, {}, {}};
  for (size_t i = 0; i < observed.keypoints.size(); ++i)
    if (pose.inlier[i])
      loop.old_landmarks.emplace_back(observed.keypoints[i],
                                      guided.landmarks[observed.keypoints[i]]);
  const auto shared = SharedPoints(map, here, loop);
  std::optional<double> scale = ScaleOf(shared, here.cam_from_world, pose.cam_from_world);
  const bool is_scale_by_points = scale.has_value();
  if (!scale && candidate.by_objects) scale = candidate.by_objects->scale;
  if (!scale && !candidate.is_near) return std::nullopt;
  // Both poses are of the same camera: s (R_current x + t_current) = R_old x' + t_old.
  loop.old_from_current =
      Similarity(pose.cam_from_world.Inverse()) *
      Similarity(scale.value_or(1), Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()) *
      Similarity(here.cam_from_world);
  if (!candidate.is_near && is_scale_by_points &&
      CountConsistent(shared, loop.old_from_current, pose.cam_from_world) <
          std::max(kMinScalePairs, static_cast<int>(shared.size()) / 2))  // at least half of them
    return std::nullopt;
  return loop;
}

}  // namespace oaslam
