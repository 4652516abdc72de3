#include "oaslam/relocalization/object_hypotheses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/geometry/p3p.h"
#include "oaslam/geometry/up2p.h"
#include "oaslam/relocalization/object_grid.h"

namespace oaslam {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
// The depth estimated from the size of a box is right within this factor.
constexpr double kDepthFactor = 1.7;
// The same for a truncated box: the object may be much nearer.
constexpr double kTruncatedFactor = 3;
constexpr size_t kStarts = 3;            // number of detections that hypotheses start from
constexpr size_t kMaxTriplets = 1500;    // at most, from one start
constexpr size_t kTripletBudget = 2500;  // at most, from all starts, in a large map
// In a large map a start is used only if it is compatible with nearly as many detections as the
// best one: at least this share.
constexpr double kLeastSupport = 0.9;
constexpr size_t kMostStarts = 30;
constexpr double kTiltStep = 7 * kDegree, kTiltMargin = 12 * kDegree;
constexpr int kYaws = 36;
constexpr size_t kSmallMap = 40;  // in maps with at most this many objects, all are scored
// In larger maps objects are scored within this many times the greatest depth of the start.
constexpr double kScopeDepths = 1.2;

// A hypothesis that a detection shows an object, with the depth that its size suggests.
struct Node {
  int detection = 0, object = 0;
  double depth = 0, min_depth = 0, max_depth = 0;
};

Node MakeNode(const ObjectScene& scene, int detection, int object) {
  const SceneDetection& d = scene.detections[detection];
  const double depth = d.depth_per_radius * scene.objects[object].radius;
  return {detection, object, depth, depth / (d.truncated ? kTruncatedFactor : kDepthFactor),
          depth * kDepthFactor};
}

// Whether both can be true: some depths s and t within the bounds of both put the objects at their
// distance in the map. The squared distance |s p - t q|^2 is convex and without bounds smallest at
// depth 0: within them it is largest in a corner and smallest on a side.
bool AreCompatible(const ObjectScene& scene, const Node& a, const Node& b) {
  if (a.detection == b.detection || a.object == b.object) return false;
  const Eigen::Vector3d &p = scene.detections[a.detection].ray,
                        &q = scene.detections[b.detection].ray;
  const double pp = p.squaredNorm(), qq = q.squaredNorm(), pq = p.dot(q);
  const double between =
      (scene.objects[a.object].ellipsoid.center - scene.objects[b.object].ellipsoid.center)
          .squaredNorm();
  const auto squared = [&](double s, double t) { return s * s * pp + t * t * qq - 2 * s * t * pq; };
  double farthest = 0;
  for (const double s : {a.min_depth, a.max_depth})
    for (const double t : {b.min_depth, b.max_depth}) farthest = std::max(farthest, squared(s, t));
  if (between > farthest) return false;
  double nearest = std::numeric_limits<double>::max();
  for (const double s : {a.min_depth, a.max_depth})
    nearest = std::min(nearest, squared(s, std::clamp(s * pq / qq, b.min_depth, b.max_depth)));
  for (const double t : {b.min_depth, b.max_depth})
    nearest = std::min(nearest, squared(std::clamp(t * pq / pp, a.min_depth, a.max_depth), t));
  return between >= nearest;
}

// The detections to start from: untruncated ones first, then those whose class
// has the fewest objects.
std::vector<int> DetectionsToStartFrom(const ObjectScene& scene) {
  std::vector<int> order(scene.detections.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](int a, int b) {
    const SceneDetection &x = scene.detections[a], &y = scene.detections[b];
    if ((x.truncated != 0) != (y.truncated != 0)) return x.truncated == 0;
    return x.objects.size() < y.objects.size();
  });
  order.resize(std::min(order.size(), kStarts));
  return order;
}

// A node that hypotheses start from, and the nodes that are compatible with it.
struct Start {
  Node origin;
  std::span<const int> done;  // detections that earlier starts came from
  std::vector<Node> neighbors{};
  int support = 0;       // number of distinct detections among the neighbors
  double agreement = 0;  // sum over these detections
};

// Finds the starts of hypotheses, and the objects about them.
class Neighborhoods {
 public:
  explicit Neighborhoods(const ObjectScene& scene)
      : scene_(scene),
        detections_(DetectionsToStartFrom(scene)),
        depths_(DepthsOf(scene)),
        grid_(Centers(scene), UsualReach(depths_)) {}

  bool IsLargeMap() const { return scene_.objects.size() > kSmallMap; }

  // The objects that a pose from this node is scored by.
  std::vector<int> ScopeOf(const Node& origin) const {
    std::vector<int> scope;
    if (IsLargeMap()) {
      grid_.FindNear(scene_.objects[origin.object].ellipsoid.center,
                     kScopeDepths * origin.max_depth, scope);
    } else {
      scope.resize(scene_.objects.size());
      std::iota(scope.begin(), scope.end(), 0);
    }
    return scope;
  }

  // In a large map only the starts that most other detections are compatible with, and of these the
  // ones that agree best: elsewhere the detection probably shows another object.
  std::vector<Start> FindStarts() const {
    std::vector<Start> starts;
    // Detections that were used as starts already are left out.
    for (size_t i = 0; i < detections_.size(); ++i)
      for (const int object : scene_.detections[detections_[i]].objects)
        starts.push_back(
            {MakeNode(scene_, detections_[i], object), std::span(detections_).first(i)});
    std::vector<int> near;
    if (IsLargeMap()) KeepBest(starts);
    for (Start& start : starts) {
      VisitCompatible(start, near, [&](const Node& node) { start.neighbors.push_back(node); });
      std::ranges::stable_sort(start.neighbors, {}, &Node::detection);
    }
    return starts;
  }

 private:
  struct Depths {
    double min = std::numeric_limits<double>::max(), max = 0;
  };

  // The depths at which any object of its class can be, for each detection.
  static std::vector<Depths> DepthsOf(const ObjectScene& scene) {
    std::vector<Depths> depths(scene.detections.size());
    for (int d = 0; d < static_cast<int>(depths.size()); ++d)
      for (const int o : scene.detections[d].objects) {
        const Node node = MakeNode(scene, d, o);
        depths[d].min = std::min(depths[d].min, node.min_depth);
        depths[d].max = std::max(depths[d].max, node.max_depth);
      }
    return depths;
  }
  // About the distance within which neighbours are looked for, and some more: few large cells are
  // faster than many small ones.
  static double UsualReach(const std::vector<Depths>& depths) {
    double reach = 1e-9;
    for (const Depths& d : depths) reach = std::max(reach, d.max);
    return 4 * reach;
  }
  // How far from the origin's object any object of another detection can be.
  double ReachOf(const Node& origin) const {
    const Eigen::Vector3d& p = scene_.detections[origin.detection].ray;
    double squared = 0;
    for (size_t d = 0; d < depths_.size(); ++d)
      for (const double s : {origin.min_depth, origin.max_depth})
        for (const double t : {depths_[d].min, depths_[d].max})
          squared = std::max(squared, (s * p - t * scene_.detections[d].ray).squaredNorm());
    return std::sqrt(squared) + 1e-9;
  }

  static std::vector<Eigen::Vector3d> Centers(const ObjectScene& scene) {
    std::vector<Eigen::Vector3d> centers;
    for (const SceneObject& object : scene.objects) centers.push_back(object.ellipsoid.center);
    return centers;
  }

  // Calls visit(node) for the nodes of other detections that are compatible with the start.
  // `near` is scratch memory.
  template <typename Visitor>
  void VisitCompatible(const Start& start, std::vector<int>& near, Visitor&& visit) const {
    const Node& origin = start.origin;
    grid_.FindNear(scene_.objects[origin.object].ellipsoid.center, ReachOf(origin), near);
    for (const int o : near)
      for (const int d : scene_.objects[o].detections) {
        if (std::ranges::find(start.done, d) != start.done.end()) continue;
        const Node node = MakeNode(scene_, d, o);
        if (AreCompatible(scene_, origin, node)) visit(node);
      }
  }

  // By how much the distance of two objects differs from the one that their sizes suggest: the
  // square of the ratio of the larger to the smaller.
  double SquaredRatio(const Node& a, const Node& b) const {
    const double between =
        (scene_.objects[a.object].ellipsoid.center - scene_.objects[b.object].ellipsoid.center)
            .squaredNorm();
    const double expected = (a.depth * scene_.detections[a.detection].ray -
                             b.depth * scene_.detections[b.detection].ray)
                                .squaredNorm();
    return between > expected ? between / expected : expected / between;
  }
  // How well they agree, at most 1.
  static double Agreement(double squared_ratio) {
    constexpr double kSigma = 0.3;  // of the logarithm of the ratio
    const double off = std::log(squared_ratio) / 2 / kSigma;
    return std::exp(-off * off / 2);
  }

  void KeepBest(std::vector<Start>& starts) const {
    constexpr double kNone = std::numeric_limits<double>::max();
    int most = 0;
    std::vector<double> least_ratios(scene_.detections.size());
    std::vector<int> near;
    for (Start& start : starts) {
      std::ranges::fill(least_ratios, kNone);
      VisitCompatible(start, near, [&](const Node& node) {
        double& least = least_ratios[node.detection];
        least = std::min(least, SquaredRatio(start.origin, node));
      });
      for (const double ratio : least_ratios) {
        if (ratio == kNone) continue;
        ++start.support;
        start.agreement += Agreement(ratio);
      }
      most = std::max(most, start.support);
    }
    std::erase_if(starts, [&](const Start& start) { return start.support < kLeastSupport * most; });
    std::ranges::stable_sort(starts, std::ranges::greater{}, &Start::agreement);
    starts.resize(std::min(starts.size(), kMostStarts));
  }

  const ObjectScene& scene_;
  std::vector<int> detections_;
  std::vector<Depths> depths_;  // by detection
  ObjectGrid grid_;
};

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

  std::vector<PoseGuess> Run(Rng& rng) {
    const Neighborhoods neighborhoods(scene_);
    const std::vector<Start> starts = neighborhoods.FindStarts();
    const size_t most_triplets =
        neighborhoods.IsLargeMap()
            ? std::min(kMaxTriplets, kTripletBudget / std::max<size_t>(starts.size(), 1))
            : kMaxTriplets;
    for (const Start& start : starts) {
      scope_ = neighborhoods.ScopeOf(start.origin);
      for (const Node& other : start.neighbors) AddPair(start.origin, other);
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

  // Pairs of neighbors that are compatible: of all, or of as many drawn at random.
  void FindTriplets(const std::vector<Node>& neighbors, Rng& rng) {
    constexpr size_t kMostPairs = 20'000;
    triplets_.clear();
    const size_t count = neighbors.size();
    const auto try_pair = [&](size_t i, size_t j) {
      if (AreCompatible(scene_, neighbors[i], neighbors[j])) triplets_.emplace_back(i, j);
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
    const std::vector<Node>& neighbors = start.neighbors;
    FindTriplets(neighbors, rng);
    for (size_t k = 0; k < triplets_.size() && k < most; ++k) {
      if (triplets_.size() > most)
        std::swap(triplets_[k], triplets_[k + rng.Index(static_cast<int>(triplets_.size() - k))]);
      const std::array group = {start.origin, neighbors[triplets_[k].first],
                                neighbors[triplets_[k].second]};
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
  std::vector<PoseGuess> guesses_;
};

}  // namespace

bool AreDifferent(const Rigid3& a, const Rigid3& b, double distance, double angle_rad) {
  if ((a.OriginInSource() - b.OriginInSource()).squaredNorm() > distance * distance) return true;
  return 2 * std::acos(std::min(std::abs(a.rotation.dot(b.rotation)), 1.0)) > angle_rad;
}

std::vector<PoseGuess> GuessFromGroups(const ObjectScene& scene, Rng& rng) {
  return GroupGuesser(scene).Run(rng);
}

std::vector<PoseGuess> GuessFromSingles(const ObjectScene& scene) {
  std::vector<PoseGuess> guesses;
  const std::vector<Eigen::Vector3d> ups = UpDirections(scene);
  const Neighborhoods neighborhoods(scene);
  for (const Start& start : neighborhoods.FindStarts()) {
    const Node& node = start.origin;
    const SceneDetection& detection = scene.detections[node.detection];
    const std::vector<int> scope = neighborhoods.ScopeOf(node);
    const Eigen::Vector3d& center = scene.objects[node.object].ellipsoid.center;
    for (const Eigen::Vector3d& up : ups) {
      const Eigen::Quaterniond tilt = Eigen::Quaterniond::FromTwoVectors(*scene.up, up);
      for (int yaw = 0; yaw < kYaws; ++yaw) {
        Rigid3 pose;
        pose.rotation = tilt * Eigen::Quaterniond(Eigen::AngleAxisd(
                                   2 * std::numbers::pi * yaw / kYaws, *scene.up));
        const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
        pose.translation = node.depth * detection.ray - rotation * center;
        // The depth is corrected: it came from a sphere, but the object's outline from this side
        // has another size.
        const double ratio = SizeRatio(scene, node, pose, rotation);
        if (!(ratio > 0.3 && ratio < 3)) continue;
        pose.translation = ratio * node.depth * detection.ray - rotation * center;
        guesses.push_back({pose, scene.ScorePose(pose, scope), ratio * node.depth});
      }
    }
  }
  return guesses;
}

std::vector<PoseGuess> SelectDistinct(std::vector<PoseGuess> guesses, size_t count) {
  constexpr double kDistancePerDepth = 0.08, kAngle = 6 * kDegree;  // 12 cm at 1.5 m
  std::ranges::stable_sort(guesses, std::greater<>(), &PoseGuess::score);
  std::vector<PoseGuess> chosen;
  for (const PoseGuess& guess : guesses) {
    if (chosen.size() >= count || !(guess.score > 0)) break;
    const auto differs = [&](const PoseGuess& c) {
      return AreDifferent(c.cam_from_world, guess.cam_from_world, kDistancePerDepth * guess.depth,
                          kAngle);
    };
    if (std::ranges::all_of(chosen, differs)) chosen.push_back(guess);
  }
  return chosen;
}

}  // namespace oaslam
