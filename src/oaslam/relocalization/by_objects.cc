#include "oaslam/relocalization/by_objects.h"

#include <Eigen/LU>
#include <algorithm>

#include "oaslam/relocalization/object_refinement.h"
#include "oaslam/relocalization/object_search.h"

namespace oaslam {
namespace {

constexpr size_t kReturned = 5;  // as many as candidates.txt lists for an image

// Selects distinct poses from `refined`, which is sorted best first, and computes their margins.
std::vector<ObjectPoseCandidate> DistinctCandidates(const std::vector<FoundPose>& refined) {
  std::vector<FoundPose> distinct;
  for (const FoundPose& r : refined) {
    const bool is_new =
        std::ranges::all_of(distinct, [&](const FoundPose& d) { return AreElsewhere(d, r); });
    if (is_new && distinct.size() < kReturned) distinct.push_back(r);
  }
  std::vector<ObjectPoseCandidate> candidates;
  for (const FoundPose& d : distinct) {
    candidates.push_back(d.candidate);
    const auto rival =
        std::ranges::find_if(refined, [&](const FoundPose& r) { return AreElsewhere(d, r); });
    candidates.back().margin =
        d.candidate.score - (rival == refined.end() ? 0 : std::max(rival->candidate.score, 0.0));
  }
  return candidates;
}

}  // namespace

std::vector<ObjectPoseCandidate> RelocalizeByObjects(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, const std::optional<Eigen::Vector3d>& gravity_in_cam,
    Rng& rng) {
  const ObjectScene scene(detections, camera, map, config, gravity_in_cam);
  if (scene.detections.empty()) return {};
  const ObjectDemands demands(scene, config);
  const std::vector<FoundPose> refined = SearchPoses(scene, demands, rng);
  std::vector<ObjectPoseCandidate> candidates = DistinctCandidates(refined);
  if (!candidates.empty()) {
    ObjectPoseCandidate& best = candidates.front();
    best.accepted = demands.AreMetBy(best, static_cast<int>(best.matched.size()));
  }
  return candidates;
}

ObjectPoseCandidate RefineByPointsAndObjects(std::span<const ObjectDetection> detections,
                                             const Camera& camera, const Map& map,
                                             const RelocalizationConfig& config,
                                             const RelocalizationReport& by_points) {
  const ObjectScene scene(detections, camera, map, config, std::nullopt);
  const PosePrior prior{by_points.cam_from_world,
                        (by_points.covariance * by_points.inliers).inverse()};
  return RefineObjectPose(scene, by_points.cam_from_world, prior);
}

}  // namespace oaslam
