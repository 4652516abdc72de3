#include <algorithm>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/matching/fusion.h"

namespace oaslam {
namespace {

constexpr int kNeighbours = 10, kIterations = 20;
constexpr double kFusionRadiusPx = 5;

// A share of a correction: positions move straight, orientations along the shortest turn.
Eigen::Vector3d MovedBy(const Similarity& s, double share, const Eigen::Vector3d& x) { return (1 - share) * x + share * (s * x); }

Rigid3 MovedBy(const Similarity& s, double share, const Rigid3& cam_from_world) {
  const Eigen::Quaterniond turn = Eigen::Quaterniond::Identity().slerp(share, s.rotation);
  const Eigen::Quaterniond rotation = (cam_from_world.rotation * turn.conjugate()).normalized();
  return {rotation, -(rotation * MovedBy(s, share, cam_from_world.OriginInSource()))};
}

std::vector<LandmarkId> LandmarksAround(const Map& map, KeyframeId keyframe) {
  std::vector<KeyframeId> group = map.CovisibleKeyframes(keyframe, kNeighbours);
  group.push_back(keyframe);
  return LandmarksSeenBy(map, group);
}

void SpreadCorrection(const LoopClosure& loop, Map& map) {
  const std::vector<KeyframeId> ids = map.keyframes.Ids();
  const auto rank = [&](KeyframeId id) { return std::ranges::lower_bound(ids, id) - ids.begin(); };
  const double begin = static_cast<double>(rank(loop.old)), end = static_cast<double>(rank(loop.current));
  const auto share = [&](KeyframeId id) { return std::clamp((static_cast<double>(rank(id)) - begin) / (end - begin), 0.0, 1.0); };
  for (const LandmarkId id : map.landmarks.Ids()) {
    Landmark& landmark = map.landmarks.MutableAt(id);
    landmark.position = MovedBy(loop.old_from_current, share(landmark.observations.front().keyframe), landmark.position);
  }
  for (const KeyframeId id : ids) {
    Keyframe& keyframe = map.keyframes.MutableAt(id);
    keyframe.cam_from_world = MovedBy(loop.old_from_current, share(id), keyframe.cam_from_world);
  }
}

}  // namespace

void CorrectLoop(const LoopClosure& loop, int min_shared_landmarks, Map& map) {
  std::vector<KeyframeId> ends = map.CovisibleKeyframes(loop.current, kNeighbours);
  ends.push_back(loop.current);
  const std::vector<LandmarkId> old = LandmarksAround(map, loop.old);
  SpreadCorrection(loop, map);

  std::vector<FusionCandidate> seen;
  for (const auto& [keypoint, landmark] : loop.old_landmarks) seen.push_back({landmark, keypoint});
  ApplyFusion(seen, loop.current, map);
  for (const KeyframeId id : ends) ApplyFusion(FindFusionCandidates(map, id, old, kFusionRadiusPx), id, map);
  for (const KeyframeId id : ends) map.UpdateCovisibility(id, min_shared_landmarks);
  ApplyCorrection(GlobalBundleAdjustment(map, kIterations), map);
  for (const LandmarkId id : map.landmarks.Ids()) map.UpdateLandmarkGeometry(id);
  for (const KeyframeId id : map.keyframes.Ids()) map.UpdateCovisibility(id, min_shared_landmarks);
}

}  // namespace oaslam
