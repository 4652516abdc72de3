#include "oaslam/relocalization/object_hypotheses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/geometry/p3p.h"
#include "oaslam/geometry/up2p.h"
#include "oaslam/relocalization/object_neighbourhoods.h"

namespace oaslam {
namespace {

constexpr size_t kMaxTriplets = 1500;    // at most, from one start; bounds the time
constexpr size_t kTripletBudget = 2500;  // at most, from all starts in a large map; bounds the time
// Refinement converges from half a step. The margin covers views steeper than those of mapping.
constexpr double kTiltStep = 7 * kDegree, kTiltMargin = 12 * kDegree;
constexpr int kYaws = 36;  // steps of 10 degrees, half of which refinement corrects

// The ratio of predicted to measured size of one of the boxes from which a pose was made; 0 behind
// the camera.
double SizeRatio(const ObjectScene& scene, const Node& node, const Rigid3& pose,
                 const Eigen::Matrix3d& rotation) {
  const SceneObject& object = scene.objects[node.object];
  const Eigen::Vector3d center = pose.translation + rotation * object.ellipsoid.center;
  const OutlineConic outline = OutlineOf(center, rotation * object.scaled_axes);
  if (!IsInFront(center.z(), outline)) return 0;
  return SizeOf(OutlineBox(outline, scene.camera)) / scene.detections[node.detection].size;
}

bool HasPlausibleSize(const ObjectScene& scene, const Node& node, const Rigid3& pose,
                      const Eigen::Matrix3d& rotation) {
  const double ratio = SizeRatio(scene, node, pose, rotation);
  return ratio > 0.5 &&
         ratio < (scene.detections[node.detection].truncated ? 2 * kTruncatedFactor : 2.0);
}

// The directions of the vertical in the camera to try.
std::vector<Eigen::Vector3d> UpDirections(const ObjectScene& scene) {
  if (!scene.up) return {};
  if (scene.up_in_cam) return {*scene.up_in_cam};
  std::vector<Eigen::Vector3d> ups;
  const double low = scene.attitudes.min_pitch - kTiltMargin,
               high = scene.attitudes.max_pitch + kTiltMargin;
  const int steps = std::max(static_cast<int>(std::ceil((high - low) / kTiltStep)), 1);
  for (int i = 0; i <= steps; ++i)
    ups.push_back(UpInCamera(low + (high - low) * i / steps, scene.attitudes.mean_roll));
  return ups;
}

// Makes guesses of the pose from pairs and triplets of nodes.
class GroupGuesser {
 public:
  explicit GroupGuesser(const ObjectScene& scene) : scene_(scene), ups_(UpDirections(scene)) {}

  std::vector<PoseHypothesis> Run(Rng& rng) {
    const Neighbourhoods neighbourhoods(scene_);
    const std::vector<Start> starts = neighbourhoods.FindStarts();
    const size_t most_triplets =
        neighbourhoods.IsLargeMap()
            ? std::min(kMaxTriplets, kTripletBudget / std::max<size_t>(starts.size(), 1))
            : kMaxTriplets;
    for (const Start& start : starts) {
      scope_ = neighbourhoods.ScopeOf(start.origin);
      for (const Node& other : start.neighbours) AddPair(start.origin, other);
      if (!scene_.up_in_cam) AddTriplets(start, most_triplets, rng);
    }
    return std::move(guesses_);
  }

 private:
  void AddPair(const Node& a, const Node& b) {
    const std::array rays = {scene_.detections[a.detection].ray,
                             scene_.detections[b.detection].ray};
    const std::array points = {scene_.objects[a.object].ellipsoid.center,
                               scene_.objects[b.object].ellipsoid.center};
    for (const Eigen::Vector3d& up : ups_) {
      const Up2PPoses solved = SolveUp2P(rays, up, points, *scene_.up);
      for (int i = 0; i < solved.count; ++i) AddPose(solved.poses[i], std::array{a, b});
    }
  }

  // Pairs of neighbours that are compatible: of all, or of as many drawn at random.
  void FindTriplets(const std::vector<Node>& neighbours, Rng& rng) {
    constexpr size_t kMostPairs = 20'000;  // bounds the time in a large map
    triplets_.clear();
    const size_t count = neighbours.size();
    const auto try_pair = [&](size_t i, size_t j) {
      if (AreCompatible(scene_, neighbours[i], neighbours[j])) triplets_.emplace_back(i, j);
    };
    if (count > 0 && count * (count - 1) / 2 > kMostPairs) {
      const auto draw = [&] { return static_cast<size_t>(rng.Index(static_cast<int>(count))); };
      for (size_t k = 0; k < kMostPairs; ++k) {
        const size_t i = draw();
        try_pair(i, draw());
      }
      return;
    }
    for (size_t i = 0; i < count; ++i)
      for (size_t j = i + 1; j < count; ++j) try_pair(i, j);
  }

  void AddTriplets(const Start& start, size_t most, Rng& rng) {
    const std::vector<Node>& neighbours = start.neighbours;
    FindTriplets(neighbours, rng);
    for (size_t k = 0; k < triplets_.size() && k < most; ++k) {
      if (triplets_.size() > most)
        std::swap(triplets_[k], triplets_[k + rng.Index(static_cast<int>(triplets_.size() - k))]);
      const std::array group = {start.origin, neighbours[triplets_[k].first],
                                neighbours[triplets_[k].second]};
      std::array<Eigen::Vector3d, 3> rays, points;
      for (int n = 0; n < 3; ++n) {
        rays[n] = scene_.detections[group[n].detection].ray.normalized();
        points[n] = scene_.objects[group[n].object].ellipsoid.center;
      }
      const P3PPoses solved = SolveP3P(rays, points);
      for (int i = 0; i < solved.count; ++i) AddPose(solved.poses[i], group);
    }
  }

  template <size_t N>
  void AddPose(const Rigid3& pose, const std::array<Node, N>& group) {
    const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
    if (!scene_.IsPlausiblyHeld(rotation)) return;
    for (const Node& node : group)
      if (!HasPlausibleSize(scene_, node, pose, rotation)) return;
    guesses_.push_back({pose, scene_.ScorePose(pose, scope_), group[0].depth});
  }

  const ObjectScene& scene_;
  std::vector<Eigen::Vector3d> ups_;
  std::vector<int> scope_;
  std::vector<std::pair<size_t, size_t>> triplets_;
  std::vector<PoseHypothesis> guesses_;
};

}  // namespace

bool AreDifferent(const Rigid3& a, const Rigid3& b, double distance, double angle_rad) {
  if ((a.OriginInSource() - b.OriginInSource()).squaredNorm() > distance * distance) return true;
  return 2 * std::acos(std::min(std::abs(a.rotation.dot(b.rotation)), 1.0)) > angle_rad;
}

std::vector<PoseHypothesis> GuessFromGroups(const ObjectScene& scene, Rng& rng) {
  return GroupGuesser(scene).Run(rng);
}

std::vector<PoseHypothesis> GuessFromSingles(const ObjectScene& scene) {
  std::vector<PoseHypothesis> guesses;
  const std::vector<Eigen::Vector3d> ups = UpDirections(scene);
  const Neighbourhoods neighbourhoods(scene);
  for (const Start& start : neighbourhoods.FindStarts()) {
    const Node& node = start.origin;
    const SceneDetection& detection = scene.detections[node.detection];
    const std::vector<int> scope = neighbourhoods.ScopeOf(node);
    const Eigen::Vector3d& center = scene.objects[node.object].ellipsoid.center;
    for (const Eigen::Vector3d& up : ups) {
      const Eigen::Quaterniond tilt = TurnBetween(*scene.up, up);
      for (int yaw = 0; yaw < kYaws; ++yaw) {
        Rigid3 pose;
        pose.rotation = tilt * Eigen::Quaterniond(Eigen::AngleAxisd(
                                   2 * std::numbers::pi * yaw / kYaws, *scene.up));
        const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
        pose.translation = node.depth * detection.ray - rotation * center;
        // A depth that was not measured is corrected: it came from a sphere, but the object's
        // outline from this side has another size.
        const double ratio = SizeRatio(scene, node, pose, rotation);
        // The outline of no likely object differs more from a sphere's.
        if (!(ratio > 0.3 && ratio < 3)) continue;
        const double depth = detection.surface > 0 ? node.depth : ratio * node.depth;
        pose.translation = depth * detection.ray - rotation * center;
        guesses.push_back({pose, scene.ScorePose(pose, scope), depth});
      }
    }
  }
  return guesses;
}

std::vector<PoseHypothesis> SelectDistinct(std::vector<PoseHypothesis> guesses, size_t count) {
  constexpr double kDistancePerDepth = 0.08,
                   kAngle = 6 * kDegree;  // 12 cm at 1.5 m, which refinement corrects
  std::ranges::stable_sort(guesses, std::greater<>(), &PoseHypothesis::score);
  std::vector<PoseHypothesis> chosen;
  for (const PoseHypothesis& guess : guesses) {
    if (chosen.size() >= count || !(guess.score > 0)) break;
    const auto differs = [&](const PoseHypothesis& c) {
      return AreDifferent(c.cam_from_world, guess.cam_from_world, kDistancePerDepth * guess.depth,
                          kAngle);
    };
    if (std::ranges::all_of(chosen, differs)) chosen.push_back(guess);
  }
  return chosen;
}

}  // namespace oaslam
