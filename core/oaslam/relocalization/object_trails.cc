#include "oaslam/relocalization/object_trails.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/relocalization/confidence.h"
#include "oaslam/relocalization/object_refinement.h"
#include "oaslam/relocalization/object_search.h"

namespace oaslam {
namespace {

constexpr size_t kFollowed = 8, kToldPoses = 5;  // poses; following one takes time
// seconds without a detection: the predicted pose is too uncertain by then
constexpr double kForgotten = 1;
// The time in seconds in which an image's share of the mean score falls to 1/e. Tuned on fr2/desk
// and the sample (docs/lab/relocalization.md).
constexpr double kMemory = 0.6;
// The errors of boxes are correlated for about this long (six images at 30 Hz, as in the fit of
// ellipsoids), so that images which follow each other faster count less as evidence.
constexpr double kIndependent = 0.2;  // seconds

double WeightOf(double seconds) { return std::clamp(seconds / kIndependent, 1e-3, 1.0); }

}  // namespace

// Refines the predicted pose of a trail by the boxes of the newest image.
void ObjectTrails::GoOn(Trail& trail, const ObjectScene& scene, double seconds) {
  trail.motion.Predict(seconds);
  const PosePrior prior{trail.motion.cam_from_world(), InverseOf<6>(trail.motion.covariance())};
  Relocalization& now = trail.newest;
  now = RefineObjectPose(scene, {prior.cam_from_world, 0, now.objects.depth}, prior);
  if (now.objects.matched.empty())
    now.cam_from_world = prior.cam_from_world;
  else
    trail.motion.Correct(now.cam_from_world, now.covariance);
  const double sigma_alone = now.sigma_position();
  now.covariance = trail.motion.covariance();
  if (sigma_alone > 0) now.objects.relative_sigma *= now.sigma_position() / sigma_alone;
  const double weight = WeightOf(seconds), kept = std::exp(-seconds / kMemory);
  trail.score = kept * trail.score + weight * now.objects.score;
  trail.weight = kept * trail.weight + weight;
}

void ObjectTrails::KeepDistinct(std::vector<Trail> trails, double timestamp) {
  std::ranges::stable_sort(trails,
                           [](const Trail& a, const Trail& b) { return a.score > b.score; });
  trails_.clear();
  for (Trail& trail : trails) {
    if (std::ranges::any_of(trails_,
                            [&](const Trail& t) { return !AreElsewhere(t.newest, trail.newest); }))
      continue;
    for (const auto& [detection, object] : trail.newest.objects.matched)
      trail.matched_at.insert_or_assign(object, timestamp);
    std::erase_if(trail.matched_at,
                  [&](const auto& matched) { return timestamp - matched.second > kForgotten; });
    trails_.push_back(std::move(trail));
    if (trails_.size() == kFollowed) break;
  }
}

// The newest poses of the best trails. All scores are divided by the weight of the best one, since
// a rival that is new has not explained the images before.
std::vector<Relocalization> ObjectTrails::NewestPoses() const {
  std::vector<Relocalization> poses;
  for (const Trail& trail : trails_) {
    if (poses.size() == kToldPoses) break;
    const size_t rival = poses.empty() ? 1 : 0;
    const double rival_score = rival < trails_.size() ? std::max(trails_[rival].score, 0.0) : 0;
    Relocalization& pose = poses.emplace_back(trail.newest);
    pose.objects.score = trail.score / trails_.front().weight;
    pose.objects.margin = (trail.score - rival_score) / trails_.front().weight;
    pose.confidence = ConfidenceOfObjects(pose.objects);
  }
  return poses;
}

std::vector<Relocalization> ObjectTrails::Follow(
    double timestamp, std::span<const ObjectDetection> detections, const Camera& camera,
    const Map& map, const RelocalizationConfig& config,
    const std::optional<Eigen::Vector3d>& gravity_in_cam, Rng& rng) {
  const ObjectScene scene(detections, camera, map, config, gravity_in_cam);
  if (scene.detections.empty()) return {};
  const double seconds = timestamp_ ? timestamp - *timestamp_ : 0;
  timestamp_ = timestamp;
  std::vector<Trail> trails;
  if (seconds <= kForgotten) trails = std::move(trails_);
  for (Trail& trail : trails) GoOn(trail, scene, seconds);
  const ObjectDemands demands(scene, config);
  for (const Relocalization& found : SearchPoses(scene, demands, rng))
    if (!found.objects.matched.empty())
      trails.push_back({found,
                        MotionFilter(found.cam_from_world, found.covariance, found.objects.depth),
                        found.objects.score,
                        1,
                        {}});
  KeepDistinct(std::move(trails), timestamp);
  std::vector<Relocalization> poses = NewestPoses();
  if (!poses.empty())
    demands.Judge(static_cast<int>(trails_.front().matched_at.size()), poses.front());
  return poses;
}

}  // namespace oaslam
