#include "oaslam/odometry/rivals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "oaslam/estimation/two_view_models.h"
#include "oaslam/odometry/pose_starts.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// A sighting that is off by more than four sigmas counts as one that is off by four.
constexpr double kMostChi2 = 16;

const Eigen::Vector2d* RayIn(const WindowPoint& p, int image) {
  if (p.anchor == image) return &p.ray;
  const auto at = std::ranges::lower_bound(p.sightings, image, {}, &Sighting::image);
  return at != p.sightings.end() && at->image == image ? &at->ray : nullptr;
}

// The newest keyframe that is at least as old; null where there is none after the first image.
const WindowImage* KeyframeBefore(const Window& window, double time_s) {
  for (size_t i = window.images.size() - 1; i-- > 1;)
    if (window.images[i].is_keyframe && window.images[i].time_s <= time_s) return &window.images[i];
  return nullptr;
}

RayMatches MatchesBetween(const Window& window, int first, int second,
                          const WindowOptions& options) {
  RayMatches matches;
  matches.focal_first = matches.focal_second = options.focal_px;
  for (const WindowPoint& p : window.points) {
    const Eigen::Vector2d *before = RayIn(p, first), *now = before ? RayIn(p, second) : nullptr;
    if (!now) continue;
    matches.first.push_back(before->homogeneous());
    matches.second.push_back(now->homogeneous());
    matches.sigma.push_back(options.sigma_px);
  }
  return matches;
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

// The problem of the images since a keyframe, those before being held: of all of these, as in a
// fast turn, in which the window's free keyframes span half a second.
class MotionsSince {
 public:
  MotionsSince(const Window& window, const WindowImage& pivot, const WindowOptions& options)
      : window_(window), pivot_(pivot) {
    Window held = window;
    for (WindowImage& image : held.images) image.is_held = image.id <= pivot.id;
    made_ = ProblemOf(held, options, true);
    bare_ = made_.problem;
    bare_.velocities.clear();
    bare_.turn_rates.clear();
    bare_.rotations.clear();
    for (DepthPrior& p : bare_.points) p.sigma = 1e6;
    loose_ = made_.problem;
    loose_.velocities.clear();
    loose_.turn_rates.clear();
    for (size_t k = 0; k < made_.points.size(); ++k)
      if (IsNew(k)) loose_.points[k].sigma *= 20;
    sightings_ = std::max<double>(1, static_cast<double>(bare_.measurements.size()));
  }

  struct Start {
    InverseDepthState state;
    double cost = 0;
  };

  Start Present() const { return Rated(made_.StateOf(window_)); }

  // The newest camera has this motion from the keyframe's; the rotation that is missing is spread
  // over the time between.
  Start WithMotion(const Eigen::Quaterniond& newest_from_pivot,
                   const Eigen::Vector3d& center_in_odom) const {
    InverseDepthState state = made_.StateOf(window_);
    const Rigid3 from_pivot = pivot_.cam_from_odom.Inverse();
    const Eigen::Quaterniond present((window_.newest().cam_from_odom * from_pivot).rotation);
    const Eigen::AngleAxisd change(newest_from_pivot * present.conjugate());
    const double seconds = window_.newest().time_s - pivot_.time_s;
    const Eigen::Vector3d origin = pivot_.cam_from_odom.OriginInSource();
    for (int k = 0; k < made_.problem.free_poses; ++k) {
      const WindowImage& image = window_.images[made_.images[k]];
      const double share = (image.time_s - pivot_.time_s) / seconds;
      const Eigen::Quaterniond rotation = Eigen::AngleAxisd(share * change.angle(), change.axis()) *
                                          Eigen::Quaterniond(image.cam_from_odom.rotation);
      const Eigen::Vector3d center = origin + share * (center_in_odom - origin);
      state.poses[k] = Rigid3(Rigid3::Rotation(rotation), rotation * -center);
    }
    return WithDepths(std::move(state));
  }

  // Some images have these poses (by id, ascending), and those between them change as they do.
  Start WithPoses(std::span<const std::pair<int, Rigid3>> poses) const {
    InverseDepthState state = made_.StateOf(window_);
    std::vector<Change> changes{{pivot_.time_s}};
    for (const auto& [id, pose] : poses) {
      const WindowImage& image = window_.Image(id);
      changes.push_back(
          {image.time_s,
           Eigen::Quaterniond(pose.rotation * image.cam_from_odom.rotation.conjugate()),
           pose.OriginInSource() - image.cam_from_odom.OriginInSource()});
    }
    for (int k = 0; k < made_.problem.free_poses; ++k) {
      const WindowImage& image = window_.images[made_.images[k]];
      size_t next = 1;
      while (next + 1 < changes.size() && changes[next].time_s < image.time_s) ++next;
      const Change &before = changes[next - 1], &after = changes[next];
      const double share = (image.time_s - before.time_s) / (after.time_s - before.time_s);
      const Eigen::Quaterniond rotation =
          before.turn.slerp(share, after.turn) * Eigen::Quaterniond(image.cam_from_odom.rotation);
      const Eigen::Vector3d center =
          image.cam_from_odom.OriginInSource() + (1 - share) * before.way + share * after.way;
      state.poses[k] = Rigid3(Rigid3::Rotation(rotation), rotation * -center);
    }
    return WithDepths(std::move(state));
  }

  void ApplyTo(Window& window, const Start& start) const { made_.Apply(start.state, window); }

  void Improve(int iterations, InverseDepthSolver& solver, Start& start) const {
    solver.Minimize(loose_, {.max_iterations = iterations, .tolerance = 1e-4}, start.state);
    start.cost = CostOf(bare_, start.state, kMostChi2) / sightings_;
  }

  Window Made(const Start& start) const {
    Window window = window_;
    made_.Apply(start.state, window);
    for (size_t k = 0; k < made_.points.size(); ++k) {
      if (!IsNew(k)) continue;
      WindowPoint& p = window.points[made_.points[k]];
      p.prior_inverse_depth = p.inverse_depth;
      p.prior_sigma = std::max(std::abs(p.inverse_depth), window.median_inverse_depth);
    }
    return window;
  }

 private:
  // Of the pose of an image: its rotation from the left, and its centre.
  struct Change {
    double time_s = 0;
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    Eigen::Vector3d way = Eigen::Vector3d::Zero();
  };

  // Depths that rest on the motion are searched.
  Start WithDepths(InverseDepthState state) const {
    const double m = window_.median_inverse_depth;
    const double depths[] = {0, .1 * m, .3 * m, .6 * m, m, 1.6 * m, 2.5 * m, 4 * m, 6 * m, 9 * m};
    InverseDepthState searched = state;
    SearchDepths(depths, bare_, searched);
    for (size_t k = 0; k < made_.points.size(); ++k)
      if (IsNew(k)) state.inverse_depths[k] = searched.inverse_depths[k];
    return Rated(std::move(state));
  }

  Start Rated(InverseDepthState state) const {
    const double cost = CostOf(bare_, state, kMostChi2) / sightings_;
    return {std::move(state), cost};
  }

  // Its depth rests on the motion that is in question.
  bool IsNew(size_t k) const {
    const WindowPoint& p = window_.points[made_.points[k]];
    return p.anchor >= pivot_.id || !p.HasDepth();
  }

  const Window& window_;
  const WindowImage& pivot_;
  WindowProblem made_;
  InverseDepthProblem bare_, loose_;
  double sightings_ = 1;
};

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
      count += RayIn(window.points[i], image.id) != nullptr;
    if (count > 1) seen.push_back(i);
  }
  if (seen.size() <= kMost) return seen;
  std::vector<size_t> chosen;
  for (size_t k = 0; k < kMost; ++k) chosen.push_back(seen[k * seen.size() / kMost]);
  return chosen;
}

// The two images and up to three between them, with the points that at least two of them see: small
// enough to be looked at often. What is known of depths from before stays as a prior.
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
      const Eigen::Vector2d* ray = RayIn(p, image.id);
      if (!ray) continue;
      if (has_anchor) {
        point.sightings.push_back({image.id, Eigen::Vector2f::Zero(), *ray});
        continue;
      }
      has_anchor = true;
      const bool is_known = image.id == first.id && p.HasDepth();
      point.anchor = image.id;
      point.ray = *ray;
      point.inverse_depth = window.InverseDepthIn(p, image);
      point.prior_inverse_depth = is_known ? point.inverse_depth : window.median_inverse_depth;
      // The depth of a point is off by what its variance says, and by the errors of its place.
      point.prior_sigma = is_known ? std::max(std::sqrt(p.variance), 0.1 * point.inverse_depth)
                                   : 20 * window.median_inverse_depth;
      point.variance = is_known ? p.variance : point.prior_sigma * point.prior_sigma;
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

  std::vector<Rigid3> motions = MotionsOfEssential(FitEssential(matches, kOfEssential, rng).matrix);
  for (const Rigid3& m :
       MotionsOfHomography(FitHomography(matches, kOfHomography, rng).matrix, matches))
    motions.push_back(m);
  std::erase_if(motions, [&](const Rigid3& m) { return !IsInFront(matches, m); });
  Segment segment = Thinned(window, first, last);
  const Window thin = segment.thin;
  const MotionsSince since(thin, thin.images.front(), options);
  const double seconds = last.time_s - first.time_s;
  const Eigen::Vector3d velocity = VelocityBefore(window, first),
                        origin = first.cam_from_odom.OriginInSource();
  const double way = std::max(velocity.norm() * seconds, 1e-3 / window.median_inverse_depth);
  std::vector<MotionsSince::Start> starts;
  for (const Rigid3& motion : motions)
    for (const double stretch : kStretches)
      starts.push_back(since.WithMotion(Eigen::Quaterniond(motion.rotation),
                                        origin + stretch * way *
                                                     (first.cam_from_odom.rotation.conjugate() *
                                                      motion.OriginInSource().normalized())));
  std::vector<Eigen::Vector2d> before, now;
  for (int i = 0; i < matches.size(); ++i) {
    before.push_back(matches.first[i].head<2>());
    now.push_back(matches.second[i].head<2>());
  }
  const Rigid3 present = last.cam_from_odom * first.cam_from_odom.Inverse();
  const Eigen::Quaterniond of_flow(
      RotationBetween(before, now, present.rotation.toRotationMatrix()));
  for (const double stretch : kStretches)
    starts.push_back(since.WithMotion(of_flow, origin + stretch * seconds * velocity));

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
  since.ApplyTo(segment.thin, *best);
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

}  // namespace oaslam
