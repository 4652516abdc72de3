#include "oaslam/relocalization/by_objects.h"

#include <algorithm>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/relocalization/confidence.h"
#include "oaslam/relocalization/object_refinement.h"
#include "oaslam/relocalization/object_search.h"

namespace oaslam {
namespace {

constexpr size_t kReturned = 5;  // as many as candidates.txt lists for an image

// Selects distinct poses from `refined`, which is sorted best first, and computes their margins.
std::vector<Relocalization> DistinctPoses(const std::vector<Relocalization>& refined) {
  std::vector<Relocalization> distinct;
  for (const Relocalization& r : refined) {
    const bool is_new =
        std::ranges::all_of(distinct, [&](const Relocalization& d) { return AreElsewhere(d, r); });
    if (is_new && distinct.size() < kReturned) distinct.push_back(r);
  }
  for (Relocalization& d : distinct) {
    const auto rival =
        std::ranges::find_if(refined, [&](const Relocalization& r) { return AreElsewhere(d, r); });
    d.objects.margin =
        d.objects.score - (rival == refined.end() ? 0 : std::max(rival->objects.score, 0.0));
    d.confidence = ConfidenceOfObjects(d.objects);
  }
  return distinct;
}

}  // namespace

std::vector<Relocalization> RelocalizeByObjects(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, const std::optional<Eigen::Vector3d>& gravity_in_cam,
    Rng& rng) {
  const ObjectScene scene(detections, camera, map, config, gravity_in_cam);
  if (scene.detections.empty()) return {};
  const ObjectDemands demands(scene, config);
  std::vector<Relocalization> distinct = DistinctPoses(SearchPoses(scene, demands, rng));
  if (!distinct.empty())
    demands.Judge(static_cast<int>(distinct.front().objects.matched.size()), distinct.front());
  return distinct;
}

Relocalization RefineByPointsAndObjects(std::span<const ObjectDetection> detections,
                                        const Camera& camera, const Map& map,
                                        const RelocalizationConfig& config,
                                        const Relocalization& by_points) {
  const ObjectScene scene(detections, camera, map, config, std::nullopt);
  const PosePrior prior{by_points.cam_from_world,
                        InverseOf<6>(by_points.covariance * by_points.points.inliers)};
  return RefineObjectPose(scene, {by_points.cam_from_world}, prior);
}

}  // namespace oaslam
