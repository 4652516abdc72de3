#include <algorithm>
#include <cmath>

#include "oaslam/estimation/absolute_pose.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/matching/projection_search.h"

namespace oaslam {
namespace {

constexpr double kMaxDistanceToDepth = 0.5;
constexpr double kMinAxisCos = 0.8;
constexpr uint32_t kMinKeyframesApart = 15;
constexpr int kMaxCandidates = 3, kGroupSize = 8;
constexpr int kMinMatches = 20, kMinRansacInliers = 15, kMinInliers = 50, kMinScalePairs = 10;
constexpr double kGuidedRadiusPx = 8;

Eigen::Vector3d OpticalAxis(const Keyframe& keyframe) { return keyframe.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ(); }

// Old keyframes near the current one that nothing links to it, nearest first.
std::vector<KeyframeId> Candidates(const Map& map, KeyframeId current) {
  const Keyframe& here = map.keyframes.At(current);
  std::vector<char> linked(current.value + 1, 0);
  const auto mark = [&](KeyframeId id) { if (id <= current) linked[id.value] = 1; };
  for (const Covisible& c : here.covisible) {
    mark(c.keyframe);
    for (const Covisible& second : map.keyframes.At(c.keyframe).covisible) mark(second.keyframe);
  }
  const double reach = kMaxDistanceToDepth * map.MedianDepth(current);
  const Eigen::Vector3d center = here.cam_from_world.OriginInSource(), axis = OpticalAxis(here);
  std::vector<std::pair<double, KeyframeId>> near;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& there) {
    if (id.value + kMinKeyframesApart > current.value || linked[id.value] || axis.dot(OpticalAxis(there)) < kMinAxisCos) return;
    const double distance = (there.cam_from_world.OriginInSource() - center).norm();
    if (distance < reach) near.emplace_back(distance, id);
  });
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
    observed.points.push_back(ObservationOf(*by.features, static_cast<int>(k), map.landmarks.At(matches[k])));
    observed.keypoints.push_back(k);
  }
  return observed;
}

// How much larger the old part of the map is: the median ratio of the depths of points that both parts hold.
double ScaleOf(const Map& map, const Keyframe& here, const LoopClosure& loop, const Rigid3& cam_from_old) {
  std::vector<double> ratios;
  for (const auto& [keypoint, old] : loop.old_landmarks) {
    const Landmark* current = here.landmarks[keypoint].IsValid() ? map.landmarks.Find(here.landmarks[keypoint]) : nullptr;
    if (!current) continue;
    ratios.push_back((cam_from_old * map.landmarks.At(old).position).norm() / (here.cam_from_world * current->position).norm());
  }
  if (static_cast<int>(ratios.size()) < kMinScalePairs) return 1;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::ranges::nth_element(ratios, middle);
  return *middle;
}

std::optional<LoopClosure> Verify(const Map& map, KeyframeId current, KeyframeId old, Rng& rng) {
  const Keyframe& here = map.keyframes.At(current);
  const Camera& camera = map.cameras[here.camera];
  const LandmarkMatches matches = MatchKeyframeLandmarks(*here.features, map, map.keyframes.At(old), 0.75);
  if (matches.count < kMinMatches) return std::nullopt;
  AbsolutePoseOptions options;
  options.min_inliers = kMinRansacInliers;
  const AbsolutePoseReport rough = EstimateAbsolutePose(camera, Observe(map, here, matches.landmarks).points, options, rng);
  if (!rough.success) return std::nullopt;

  std::vector<KeyframeId> group = map.CovisibleKeyframes(old, kGroupSize);
  group.push_back(old);
  std::vector<ProjectedLandmark> projected;
  for (const LandmarkId id : LandmarksSeenBy(map, group))
    if (const auto p = ProjectLandmark(id, map.landmarks.At(id), camera, rough.cam_from_world, *here.features)) projected.push_back(*p);
  ProjectionSearchOptions search;
  search.radius_px = kGuidedRadiusPx;
  const LandmarkMatches guided =
      SearchByProjection(*here.features, map, projected, std::vector<LandmarkId>(here.features->keypoints.size()), search);
  const Observed observed = Observe(map, here, guided.landmarks);
  const PoseReport pose = RefinePose(camera, rough.cam_from_world, observed.points);
  if (!pose.success || pose.inliers < kMinInliers) return std::nullopt;

  LoopClosure loop{current, old, {}, {}};
  for (size_t i = 0; i < observed.keypoints.size(); ++i)
    if (pose.inlier[i]) loop.old_landmarks.emplace_back(observed.keypoints[i], guided.landmarks[observed.keypoints[i]]);
  // x_in_cam = s (R_current x + t_current) = R_old x' + t_old
  const double scale = ScaleOf(map, here, loop, pose.cam_from_world);
  const Rigid3 old_from_cam = pose.cam_from_world.Inverse();
  loop.old_from_current = {scale, (old_from_cam.rotation * here.cam_from_world.rotation).normalized(),
                           old_from_cam * (scale * here.cam_from_world.translation)};
  return loop;
}

}  // namespace

std::optional<LoopClosure> DetectLoop(const Map& map, KeyframeId current, Rng& rng) {
  if (!map.keyframes.Contains(current)) return std::nullopt;
  for (const KeyframeId old : Candidates(map, current))
    if (auto loop = Verify(map, current, old, rng)) return loop;
  return std::nullopt;
}

}  // namespace oaslam
