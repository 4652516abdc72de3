#include "oaslam/odometry/rivals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "oaslam/odometry/motions_since.h"
#include "oaslam/odometry/pose_starts.h"
#include "oaslam/odometry/two_images.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// The newest keyframe that is at least as old; null where there is none after the first image.
const WindowImage* KeyframeBefore(const Window& window, double time_s) {
  for (size_t i = window.images.size() - 1; i-- > 1;)
    if (window.images[i].is_keyframe && window.images[i].time_s <= time_s) return &window.images[i];
  return nullptr;
}

// Whether most points are in front of both cameras.
bool IsInFront(const RayMatches& matches, const Rigid3& second_from_first) {
  constexpr double kMost = 0.6;  // points at infinity are on either side
  int in_front = 0;
  for (int i = 0; i < matches.size(); ++i) {
    // first_depth * (y x Rx) = -(y x t), and with x and y the other way round.
    const Eigen::Vector3d turned = second_from_first.rotation * matches.first[i],
                          &y = matches.second[i], &t = second_from_first.translation;
    const Eigen::Vector3d normal = y.cross(turned);
    in_front += normal.dot(y.cross(t)) < 0 && normal.dot(turned.cross(t)) < 0;
  }
  return in_front > kMost * matches.size();
}

// The velocity of the camera before an image, over up to .3 s, in the odometry's frame.
Eigen::Vector3d VelocityBefore(const Window& window, const WindowImage& image) {
  constexpr double kSeconds = 0.3;
  const WindowImage* before = nullptr;
  for (const WindowImage& other : window.images) {
    if (other.id >= image.id) break;
    if (!before || image.time_s - other.time_s >= kSeconds) before = &other;
  }
  if (!before || image.time_s - before->time_s < 1e-3) return Eigen::Vector3d::Zero();
  return (image.cam_from_odom.OriginInSource() - before->cam_from_odom.OriginInSource()) /
         (image.time_s - before->time_s);
}

// Images of a window between two of them, with the motion that explains these best.
struct Segment {
  Window thin;
  std::vector<size_t> points;  // of each of its points, the index in the window
  double cost_before = 0, cost = 0;

  bool IsBetter() const {
    // Six films in which the motion was right had none in 1200 looks; wrong motions have .3 to .7.
    constexpr double kBetter = 0.8;
    return cost < kBetter * cost_before;
  }
};

// Of the points that two images at least see, evenly chosen ones: by index, ascending.
std::vector<size_t> PointsOf(const Window& window, const Window& thin) {
  constexpr size_t kMost = 150;  // 250 and all are as good, and take longer
  std::vector<size_t> seen;
  for (size_t i = 0; i < window.points.size(); ++i) {
    int count = 0;
    for (const WindowImage& image : thin.images)
      count += window.points[i].RayIn(image.id) != nullptr;
    if (count > 1) seen.push_back(i);
  }
  if (seen.size() <= kMost) return seen;
  std::vector<size_t> chosen;
  for (size_t k = 0; k < kMost; ++k) chosen.push_back(seen[k * seen.size() / kMost]);
  return chosen;
}

// The two images and up to three between them, with the points that at least two of them see: small
// enough to be looked at often. What the window believes of depths counts as little as its motion.
Segment Thinned(const Window& window, const WindowImage& first, const WindowImage& last) {
  constexpr size_t kBetween = 3;
  std::vector<const WindowImage*> since;
  for (const WindowImage& image : window.images)
    if (image.id > first.id && image.id <= last.id) since.push_back(&image);
  Segment segment;
  Window& thin = segment.thin;
  thin.median_inverse_depth = window.median_inverse_depth;
  thin.images.push_back(first);
  thin.images.back().is_held = true;
  const size_t chosen = std::min(since.size(), kBetween + 1);
  for (size_t i = 1; i <= chosen; ++i) {
    thin.images.push_back(*since[i * since.size() / chosen - 1]);
    thin.images.back().is_held = false;
  }
  for (const size_t i : PointsOf(window, thin)) {
    const WindowPoint& p = window.points[i];
    WindowPoint point;
    bool has_anchor = false;
    for (const WindowImage& image : thin.images) {
      const Eigen::Vector2d* ray = p.RayIn(image.id);
      if (!ray) continue;
      if (has_anchor) {
        point.sightings.push_back({image.id, Eigen::Vector2f::Zero(), *ray});
        continue;
      }
      has_anchor = true;
      point.anchor = image.id;
      point.ray = *ray;
      point.edge = p.edge.In(image.cam_from_odom * window.Image(p.anchor).cam_from_odom.Inverse());
      point.inverse_depth = window.InverseDepthIn(p, image);
      point.prior_inverse_depth = point.prior_sigma = window.median_inverse_depth;
    }
    thin.points.push_back(std::move(point));
    segment.points.push_back(i);
  }
  return segment;
}

// The motions that two images know, and the present one, each optimised; the best. Nothing where
// they share too little.
std::optional<Segment> Solved(const Window& window, const WindowImage& first,
                              const WindowImage& last, const WindowOptions& options,
                              InverseDepthSolver& solver, Rng& rng) {
  constexpr int kLeastMatches = 25;
  constexpr int kOfEssential = 100, kOfHomography = 60;  // samples
  constexpr double kStretches[] = {1, 0.4};              // of the way, if the velocity had stayed
  constexpr int kFirst = 4, kMore = 10;
  constexpr double kNear = 1.5;  // times the least cost: may become the best
  const RayMatches matches = MatchesBetween(window, first.id, last.id, options);
  if (matches.size() < kLeastMatches) return std::nullopt;

  std::vector<Rigid3> motions = MotionsBetween(matches, kOfEssential, kOfHomography, rng);
  std::erase_if(motions, [&](const Rigid3& m) { return !IsInFront(matches, m); });
  Segment segment = Thinned(window, first, last);
  const Window thin = segment.thin;
  const MotionsSince since(thin, thin.images.front(), options);
  const double seconds = last.time_s - first.time_s;
  const Eigen::Vector3d velocity = VelocityBefore(window, first),
                        origin = first.cam_from_odom.OriginInSource();
  const double way = std::max(velocity.norm() * seconds, 1e-3 / window.median_inverse_depth);
  std::vector<MotionsSince::Start> starts;
  const auto add = [&](const Eigen::Quaterniond& last_from_first, const Eigen::Vector3d& moved) {
    const Rigid3::Rotation rotation(last_from_first *
                                    Eigen::Quaterniond(first.cam_from_odom.rotation));
    for (const double stretch : kStretches) {
      const std::pair pose(last.id, Rigid3(rotation, rotation * -(origin + stretch * moved)));
      starts.push_back(since.WithPoses(std::span(&pose, 1)));
    }
  };
  for (const Rigid3& motion : motions)
    add(Eigen::Quaterniond(motion.rotation),
        way * (first.cam_from_odom.rotation.conjugate() * motion.OriginInSource().normalized()));
  std::vector<Eigen::Vector2d> before, now;
  for (int i = 0; i < matches.size(); ++i) {
    before.push_back(matches.first[i].head<2>());
    now.push_back(matches.second[i].head<2>());
  }
  const Rigid3 present = last.cam_from_odom * first.cam_from_odom.Inverse();
  add(Eigen::Quaterniond(RotationBetween(before, now, present.rotation.toRotationMatrix())),
      seconds * velocity);

  MotionsSince::Start held = since.Present();
  since.Improve(kFirst, solver, held);
  double least = held.cost;
  for (MotionsSince::Start& start : starts) {
    since.Improve(kFirst, solver, start);
    least = std::min(least, start.cost);
  }
  since.Improve(kMore, solver, held);
  const MotionsSince::Start* best = &held;
  for (MotionsSince::Start& start : starts) {
    if (start.cost > kNear * least) continue;
    since.Improve(kMore, solver, start);
    if (start.cost < best->cost) best = &start;
  }
  segment.cost_before = held.cost;
  segment.cost = best->cost;
  if (!segment.IsBetter()) best = &held;
  segment.thin = since.Made(*best);
  return segment;
}

// How much longer the second segment's unit is than the first's, whose newest image is the first
// one there: by the depths of points that both see.
double UnitOfNext(const Segment& first, const Segment& second) {
  constexpr size_t kLeast = 8;
  const WindowImage& shared = first.thin.newest();
  std::vector<double> ratios;
  for (size_t i = 0, j = 0; i < first.points.size() && j < second.points.size();) {
    if (first.points[i] != second.points[j]) {
      first.points[i] < second.points[j] ? ++i : ++j;
      continue;
    }
    const WindowPoint &a = first.thin.points[i], &b = second.thin.points[j];
    const double here = first.thin.InverseDepthIn(a, shared),
                 there = second.thin.InverseDepthIn(b, second.thin.images.front());
    if (a.sightings.back().image == shared.id && here > 0 && there > 0)
      ratios.push_back(there / here);
    ++i;
    ++j;
  }
  return ratios.size() < kLeast ? 1 : Median(std::move(ratios));
}

// The poses of the segments' images, by id: each segment goes on where the one before it ends.
std::vector<std::pair<int, Rigid3>> Chained(std::span<const Segment> segments) {
  std::vector<std::pair<int, Rigid3>> poses;
  Rigid3 at = segments.front().thin.images.front().cam_from_odom;
  double unit = 1;
  for (size_t i = 0; i < segments.size(); ++i) {
    if (i > 0) unit *= UnitOfNext(segments[i - 1], segments[i]);
    const auto& images = segments[i].thin.images;
    const Rigid3 first = images.front().cam_from_odom.Inverse();
    Rigid3 newest = at;
    for (size_t k = 1; k < images.size(); ++k) {
      Rigid3 motion = images[k].cam_from_odom * first;
      motion.translation *= unit;
      newest = motion * at;
      poses.emplace_back(images[k].id, newest);
    }
    at = newest;
  }
  return poses;
}

}  // namespace

std::optional<Rival> BetterMotion(const Window& window, double span_s, const WindowOptions& options,
                                  InverseDepthSolver& solver, Rng& rng) {
  constexpr double kMostSeconds = 0.85;
  constexpr int kIterations = 12;
  std::vector<Segment> segments;  // the newest first
  const WindowImage* last = &window.newest();
  while (window.newest().time_s - last->time_s < kMostSeconds) {
    const WindowImage* first = KeyframeBefore(window, last->time_s - span_s);
    auto segment = first ? Solved(window, *first, *last, options, solver, rng) : std::nullopt;
    if (!segment || !segment->IsBetter()) break;
    segments.push_back(*std::move(segment));
    last = first;
  }
  if (segments.empty()) return std::nullopt;
  std::reverse(segments.begin(), segments.end());
  const MotionsSince whole(window, *last, options);
  MotionsSince::Start rival = whole.WithPoses(Chained(segments)), held = whole.Present();
  whole.Improve(kIterations, solver, rival);
  whole.Improve(kIterations, solver, held);
  constexpr double kClearly = 0.97;
  if (!(rival.cost < kClearly * held.cost)) return std::nullopt;
  return Rival{whole.Made(rival), last->id};
}

std::optional<double> RivalWatch::SpanToLookAt(double time_s, double cost) {
  constexpr double kShort = 0.2, kLong = 0.4, kEvery = 0.15;  // seconds; .1 is as good
  constexpr double kRate = 0.3;                               // of the usual cost, per second
  const double elapsed = std::max(0.0, time_s - std::exchange(time_s_, time_s));
  const double step = std::min(1.0, kRate * elapsed);
  usual_cost_ = usual_cost_ > 0 ? usual_cost_ * std::exp(cost > usual_cost_ ? step : -step) : cost;
  if (cost < usual_cost_ || std::abs(time_s - looked_s_) < kEvery) return std::nullopt;
  looked_s_ = time_s;
  looks_at_long_ = !looks_at_long_;
  return looks_at_long_ ? kLong : kShort;
}

}  // namespace oaslam
