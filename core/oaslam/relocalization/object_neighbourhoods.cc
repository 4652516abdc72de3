#include "oaslam/relocalization/object_neighbourhoods.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "oaslam/estimation/ellipsoid_residuals.h"

namespace oaslam {
namespace {

// The depth estimated from the size of a box is right within this factor: the object's outline
// depends on the side from which it is seen.
constexpr double kDepthFactor = 1.7;
// Detections that hypotheses start from; more than one, since some are false.
constexpr size_t kStarts = 3;
// In a large map a start is used only if it is compatible with nearly as many detections as the
// best one: at least this share.
constexpr double kLeastSupport = 0.9;
constexpr size_t kMostStarts = 30;  // bounds the time
// in maps with at most this many objects, all are scored, which takes little time
constexpr size_t kSmallMap = 40;
// In larger maps objects are scored within this many times the greatest depth of the start; the
// margin covers errors of that depth.
constexpr double kScopeDepths = 1.2;

Node MakeNode(const ObjectScene& scene, int detection, int object) {
  const SceneDetection& d = scene.detections[detection];
  if (d.surface > 0) {
    // Its centre is behind the surface by a half axis at most, but for their errors.
    constexpr double kError = 0.1;  // a share
    const SceneObject& o = scene.objects[object];
    return {detection, object, d.surface + kFrontOfCenter * o.radius, (1 - kError) * d.surface,
            (1 + kError) * (d.surface + o.reach)};
  }
  const double depth = d.depth_per_radius * scene.objects[object].radius;
  return {detection, object, depth, depth / (d.truncated ? kTruncatedFactor : kDepthFactor),
          depth * kDepthFactor};
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

std::vector<Eigen::Vector3d> Centers(const ObjectScene& scene) {
  std::vector<Eigen::Vector3d> centers;
  for (const SceneObject& object : scene.objects) centers.push_back(object.ellipsoid.center);
  return centers;
}

// How well they agree, at most 1.
double Agreement(double squared_ratio) {
  // Of the logarithm of the ratio: sizes of boxes give depths to about 30 %.
  constexpr double kSigma = 0.3;
  const double off = std::log(squared_ratio) / 2 / kSigma;
  return std::exp(-off * off / 2);
}

}  // namespace

// The squared distance |s p - t q|^2 is a convex function of the depths s and t with its minimum at
// 0. Within the bounds it is therefore largest in a corner and smallest on a side.
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

Neighbourhoods::Neighbourhoods(const ObjectScene& scene)
    : scene_(scene),
      detections_(DetectionsToStartFrom(scene)),
      depths_(DepthsOf(scene)),
      grid_(Centers(scene), UsualReach(depths_)) {}

bool Neighbourhoods::IsLargeMap() const { return scene_.objects.size() > kSmallMap; }

std::vector<int> Neighbourhoods::ScopeOf(const Node& origin) const {
  std::vector<int> scope;
  if (IsLargeMap()) {
    grid_.FindNear(scene_.objects[origin.object].ellipsoid.center, kScopeDepths * origin.max_depth,
                   scope);
  } else {
    scope.resize(scene_.objects.size());
    std::iota(scope.begin(), scope.end(), 0);
  }
  return scope;
}

// The depths at which any object of its class can be, for each detection.
std::vector<Neighbourhoods::Depths> Neighbourhoods::DepthsOf(const ObjectScene& scene) {
  std::vector<Depths> depths(scene.detections.size());
  for (int d = 0; d < static_cast<int>(depths.size()); ++d)
    for (const int o : scene.detections[d].objects) {
      const Node node = MakeNode(scene, d, o);
      depths[d].min = std::min(depths[d].min, node.min_depth);
      depths[d].max = std::max(depths[d].max, node.max_depth);
    }
  return depths;
}

// A cell size somewhat above the distance within which neighbours are searched: few large cells are
// faster than many small ones.
double Neighbourhoods::UsualReach(const std::vector<Depths>& depths) {
  double reach = 1e-9;
  for (const Depths& d : depths) reach = std::max(reach, d.max);
  return 4 * reach;
}

// How far from the origin's object any object of another detection can be.
double Neighbourhoods::ReachOf(const Node& origin) const {
  const Eigen::Vector3d& p = scene_.detections[origin.detection].ray;
  double squared = 0;
  for (size_t d = 0; d < depths_.size(); ++d)
    for (const double s : {origin.min_depth, origin.max_depth})
      for (const double t : {depths_[d].min, depths_[d].max})
        squared = std::max(squared, (s * p - t * scene_.detections[d].ray).squaredNorm());
  return std::sqrt(squared) + 1e-9;
}

// Calls visit(node) for the nodes of other detections that are compatible with the start.
// `near` is scratch memory.
template <typename Visitor>
void Neighbourhoods::VisitCompatible(const Start& start, std::vector<int>& near,
                                     Visitor&& visit) const {
  const Node& origin = start.origin;
  grid_.FindNear(scene_.objects[origin.object].ellipsoid.center, ReachOf(origin), near);
  for (const int o : near)
    for (const auto& [d, log_agreement] : scene_.objects[o].detections) {
      if (std::ranges::find(start.done, d) != start.done.end()) continue;
      const Node node = MakeNode(scene_, d, o);
      if (AreCompatible(scene_, origin, node)) visit(node);
    }
}

// By how much the distance of two objects differs from the one that their sizes suggest: the
// square of the ratio of the larger to the smaller.
double Neighbourhoods::SquaredRatio(const Node& a, const Node& b) const {
  const double between =
      (scene_.objects[a.object].ellipsoid.center - scene_.objects[b.object].ellipsoid.center)
          .squaredNorm();
  const double expected =
      (a.depth * scene_.detections[a.detection].ray - b.depth * scene_.detections[b.detection].ray)
          .squaredNorm();
  return between > expected ? between / expected : expected / between;
}

void Neighbourhoods::KeepBest(std::vector<Start>& starts) const {
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

std::vector<Start> Neighbourhoods::FindStarts() const {
  std::vector<Start> starts;
  // Detections that were used as starts already are left out.
  for (size_t i = 0; i < detections_.size(); ++i)
    for (const int object : scene_.detections[detections_[i]].objects)
      starts.push_back({MakeNode(scene_, detections_[i], object), std::span(detections_).first(i)});
  std::vector<int> near;
  if (IsLargeMap()) KeepBest(starts);
  for (Start& start : starts) {
    VisitCompatible(start, near, [&](const Node& node) { start.neighbours.push_back(node); });
    std::ranges::stable_sort(start.neighbours, {}, &Node::detection);
  }
  return starts;
}

}  // namespace oaslam
