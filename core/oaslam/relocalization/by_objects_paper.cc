#include "oaslam/relocalization/by_objects_paper.h"

#include <algorithm>
#include <array>
#include <optional>
#include <tuple>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/geometry/p3p.h"
#include "oaslam/relocalization/object_hypotheses.h"
#include "oaslam/relocalization/object_scene.h"

namespace oaslam {
namespace {

constexpr size_t kReturnedByPaper = 5;  // as RelocalizeByObjects, to compare the two
// The paper does not state a least overlap of a detection and its object; this is the value in the
// authors' program.
constexpr double kMinIoU = 0.2;
// The paper gives no uncertainty of a pose, but the callers need a sigma: a share of the distance
// to the objects, about the error of a pose by objects (docs/lab/objects.md).
constexpr double kSigmaPerDistance = 0.05;

// A detection and an object of its class: indices into the lists of an ObjectScene.
struct Pair {
  int detection = 0, object = 0;
};
using Triplet = std::array<Pair, 3>;

struct Overlap {
  double sum = 0;
  std::vector<Pair> pairs;
};

// Assigns detections and objects one to one, the largest overlaps first. The paper's cost is a sum
// of 1 - IoU. If the sum is over all detections, with an IoU of 0 for those without an object, it
// is least where the sum of the IoU is largest. A sum over associated pairs only would be least for
// a pose that explains nothing.
Overlap OverlapOf(const ObjectScene& scene, const Rigid3& cam_from_world) {
  std::vector<std::tuple<double, int, int>> overlaps;  // -IoU, detection, object
  for (int o = 0; o < static_cast<int>(scene.objects.size()); ++o) {
    const SceneObject& object = scene.objects[o];
    if (object.detections.empty()) continue;
    const auto projected = ProjectToBox(object.ellipsoid, cam_from_world, scene.camera);
    if (!projected) continue;
    for (const auto& [d, log_agreement] : object.detections)
      if (const double iou = IoU(*projected, scene.detections[d].box); iou >= kMinIoU)
        overlaps.emplace_back(-iou, d, o);
  }
  std::ranges::sort(overlaps);
  Overlap result;
  for (const auto& [minus_iou, d, o] : overlaps) {
    const bool is_free = std::ranges::none_of(
        result.pairs, [&](const Pair& p) { return p.detection == d || p.object == o; });
    if (!is_free) continue;
    result.pairs.push_back({d, o});
    result.sum -= minus_iou;
  }
  return result;
}

bool CanBeTogether(const Pair& a, const Pair& b) {
  return a.detection != b.detection && a.object != b.object;
}

// The number of choices of three detections with an object for each, including those that use an
// object twice.
double CountTriplets(const ObjectScene& scene) {
  double singles = 0, pairs = 0, triplets = 0;
  for (const SceneDetection& detection : scene.detections) {
    const auto choices = static_cast<double>(detection.objects.size());
    triplets += choices * pairs;
    pairs += choices * singles;
    singles += choices;
  }
  return triplets;
}

// All choices of objects for three detections.
void AddTriplets(const ObjectScene& scene, int i, int j, int k, std::vector<Triplet>& triplets) {
  for (const int a : scene.detections[i].objects)
    for (const int b : scene.detections[j].objects)
      for (const int c : scene.detections[k].objects)
        if (a != b && a != c && b != c) triplets.push_back({Pair{i, a}, Pair{j, b}, Pair{k, c}});
}

std::vector<Triplet> AllTriplets(const ObjectScene& scene) {
  const int count = static_cast<int>(scene.detections.size());
  std::vector<Triplet> triplets;
  for (int i = 0; i < count; ++i)
    for (int j = i + 1; j < count; ++j)
      for (int k = j + 1; k < count; ++k) AddTriplets(scene, i, j, k, triplets);
  return triplets;
}

std::vector<Triplet> DrawTriplets(const ObjectScene& scene, Rng& rng) {
  std::vector<Pair> pairs;
  for (int d = 0; d < static_cast<int>(scene.detections.size()); ++d)
    for (const int o : scene.detections[d].objects) pairs.push_back({d, o});
  constexpr int kMaxDraws = 10 * kMaxPaperTriplets;  // since few may be valid
  const auto draw = [&] { return pairs[rng.Index(static_cast<int>(pairs.size()))]; };
  std::vector<Triplet> triplets;
  for (int i = 0; i < kMaxDraws && triplets.size() < kMaxPaperTriplets; ++i) {
    const Pair a = draw(), b = draw(), c = draw();
    if (CanBeTogether(a, b) && CanBeTogether(a, c) && CanBeTogether(b, c))
      triplets.push_back({a, b, c});
  }
  return triplets;
}

std::vector<Triplet> TripletsOf(const ObjectScene& scene, Rng& rng) {
  return CountTriplets(scene) <= kMaxPaperTriplets ? AllTriplets(scene) : DrawTriplets(scene, rng);
}

// Nothing if no pose fits the centres.
std::optional<PoseHypothesis> BestPose(const ObjectScene& scene, const Triplet& triplet) {
  std::array<Eigen::Vector3d, 3> rays, points;
  for (size_t i = 0; i < triplet.size(); ++i) {
    rays[i] = scene.detections[triplet[i].detection].ray.normalized();
    points[i] = scene.objects[triplet[i].object].ellipsoid.center;
  }
  const P3PPoses solved = SolveP3P(rays, points);
  std::optional<PoseHypothesis> best;
  for (int i = 0; i < solved.count; ++i) {
    const Rigid3& pose = solved.poses[i];
    const double score = OverlapOf(scene, pose).sum;
    if (!best || score > best->score) best = PoseHypothesis{pose, score, (pose * points[0]).z()};
  }
  return best;
}

Relocalization Describe(const ObjectScene& scene, const Rigid3& cam_from_world) {
  Relocalization found;
  found.cam_from_world = cam_from_world;
  const Overlap overlap = OverlapOf(scene, cam_from_world);
  found.objects.score = overlap.sum;
  double distance = 0;
  for (const auto& [d, o] : overlap.pairs) {
    found.objects.matched.emplace_back(scene.detections[d].index, scene.objects[o].id);
    distance += (cam_from_world * scene.objects[o].ellipsoid.center).norm();
  }
  found.objects.relative_sigma = kSigmaPerDistance;
  const double sigma = kSigmaPerDistance * distance / static_cast<double>(overlap.pairs.size());
  found.covariance.diagonal().head<3>().setConstant(sigma * sigma / 3);
  return found;
}

}  // namespace

std::vector<Relocalization> RelocalizeByObjectsAsInPaper(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, Rng& rng) {
  const ObjectScene scene(detections, camera, map, config, std::nullopt);
  std::vector<PoseHypothesis> guesses;
  for (const Triplet& triplet : TripletsOf(scene, rng))
    if (const std::optional<PoseHypothesis> guess = BestPose(scene, triplet))
      guesses.push_back(*guess);

  std::vector<Relocalization> found;
  for (const PoseHypothesis& guess : SelectDistinct(std::move(guesses), kReturnedByPaper))
    found.push_back(Describe(scene, guess.cam_from_world));
  for (size_t i = 0; i < found.size(); ++i) {
    const size_t rival = i == 0 ? 1 : 0;
    found[i].objects.margin =
        found[i].objects.score - (rival < found.size() ? found[rival].objects.score : 0);
  }
  if (!found.empty()) {
    found.front().evidence = PoseEvidence::kObjects;
    found.front().objects.suffices = true;
  }
  return found;
}

}  // namespace oaslam
