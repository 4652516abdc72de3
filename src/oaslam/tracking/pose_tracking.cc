#include "oaslam/tracking/pose_tracking.h"

#include <algorithm>

#include "oaslam/matching/descriptor_match.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/matching/projection_search.h"
#include "oaslam/tracking/local_map.h"

namespace oaslam {
namespace {

constexpr int kMinMatches = 20, kMinKeyframeMatches = 15, kMinFirstInliers = 10;
constexpr double kMotionRadiusPx = 15, kLocalRadiusPx = 4;
constexpr int kMaxLocalKeyframes = 40;

// Refines the pose on the matches and keeps the inliers.
TrackReport Refine(const Frame& frame, const Map& map, const Rigid3& initial, const std::vector<LandmarkId>& matches, int min_inliers) {
  std::vector<PointObservation> observations;
  std::vector<int> keypoints;
  for (int i = 0; i < static_cast<int>(matches.size()); ++i) {
    if (!matches[i].IsValid()) continue;
    observations.push_back(ObservationOf(*frame.features, i, map.landmarks.At(matches[i])));
    keypoints.push_back(i);
  }
  const PoseReport pose = RefinePose(map.cameras[frame.camera], initial, observations);
  TrackReport report;
  report.landmarks.resize(matches.size());
  report.matched = static_cast<int>(keypoints.size());
  if (!pose.success) return report;
  report.cam_from_world = pose.cam_from_world;
  for (size_t i = 0; i < keypoints.size(); ++i)
    if (pose.inlier[i]) report.landmarks[keypoints[i]] = matches[keypoints[i]];
  report.inliers = pose.inliers;
  report.success = pose.inliers >= min_inliers;
  return report;
}

}  // namespace

TrackReport TrackFromLastFrame(const Frame& frame, const Map& map, const Features& last_features,
                               const std::vector<LandmarkId>& last_landmarks, const Rigid3& predicted) {
  const Camera& camera = map.cameras[frame.camera];
  LandmarkMatches matches = SearchFromLastFrame(*frame.features, camera, predicted, map, last_features, last_landmarks, kMotionRadiusPx);
  if (matches.count < kMinMatches)
    matches = SearchFromLastFrame(*frame.features, camera, predicted, map, last_features, last_landmarks, 2 * kMotionRadiusPx);
  if (matches.count < kMinMatches) return {};
  return Refine(frame, map, predicted, matches.landmarks, kMinFirstInliers);
}

TrackReport TrackFromKeyframe(const Frame& frame, const Map& map, KeyframeId keyframe, const Rigid3& initial) {
  const Keyframe* from = map.keyframes.Find(keyframe);
  if (!from) return {};
  const LandmarkMatches matches = MatchKeyframeLandmarks(*frame.features, map, *from, 0.75);
  if (matches.count < kMinKeyframeMatches) return {};
  return Refine(frame, map, initial, matches.landmarks, kMinFirstInliers);
}

TrackReport TrackLocalMap(const Frame& frame, const Map& map, const TrackReport& initial, int min_inliers, double radius_scale) {
  const LocalMap local = CollectLocalMap(map, initial.landmarks, kMaxLocalKeyframes);
  TrackReport report = initial;
  report.success = false;
  if (local.keyframes.empty()) return report;

  std::vector<LandmarkId> matched;
  for (const LandmarkId id : initial.landmarks)
    if (id.IsValid()) matched.push_back(id);
  report.visible = matched;
  std::ranges::sort(matched);
  std::vector<ProjectedLandmark> projected;
  for (const LandmarkId id : local.landmarks) {
    if (std::ranges::binary_search(matched, id)) continue;
    if (const auto p = ProjectLandmark(id, map.landmarks.At(id), map.cameras[frame.camera], initial.cam_from_world, *frame.features))
      projected.push_back(*p);
  }
  ProjectionSearchOptions options;
  options.radius_px = kLocalRadiusPx * radius_scale;
  const LandmarkMatches matches = SearchByProjection(*frame.features, map, projected, initial.landmarks, options);
  for (const ProjectedLandmark& p : projected) report.visible.push_back(p.id);

  std::vector<LandmarkId> visible = std::move(report.visible);
  report = Refine(frame, map, initial.cam_from_world, matches.landmarks, min_inliers);
  report.visible = std::move(visible);
  if (report.success) report.reference = local.keyframes.front();
  return report;
}

}  // namespace oaslam
