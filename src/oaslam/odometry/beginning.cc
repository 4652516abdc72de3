#include "oaslam/odometry/beginning.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "oaslam/estimation/huber.h"
#include "oaslam/estimation/two_view.h"
#include "oaslam/estimation/two_view_models.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr int kLeastMatches = 30;               // of the first image in the newest
constexpr double kSameDirection = 8 * kDegree;  // of translation: the same minimum
constexpr int kPolished = 4;                    // of the distinct motions

// Points that the first and the newest image both see.
RayMatches MatchesOf(const Window& window, const WindowOptions& options) {
  RayMatches matches;
  matches.focal_first = matches.focal_second = options.focal_px;
  const int first = window.images.front().id, newest = window.newest().id;
  for (const WindowPoint& p : window.points) {
    if (p.anchor != first || p.sightings.empty() || p.sightings.back().image != newest) continue;
    matches.first.push_back(p.ray.homogeneous());
    matches.second.push_back(p.sightings.back().ray.homogeneous());
    matches.sigma.push_back(options.sigma_px);
  }
  return matches;
}

// px, the rotation taken away.
double MedianParallax(const RayMatches& matches, const Rigid3& newest_from_first) {
  std::vector<double> parallax;
  for (int i = 0; i < matches.size(); ++i)
    parallax.push_back(((newest_from_first.rotation * matches.first[i]).hnormalized() -
                        matches.second[i].head<2>())
                           .norm() *
                       matches.focal_first);
  return Median(parallax);
}

std::vector<BeginningMotion> MotionsToTry(const RayMatches& matches,
                                          const Rigid3& newest_from_first, Rng& rng) {
  const TwoViewOptions samples;
  std::vector<BeginningMotion> motions;
  const auto add = [&](const std::vector<Rigid3>& found) {
    for (const Rigid3& m : found)
      motions.push_back({m.rotation.conjugate(), m.OriginInSource().normalized()});
  };
  add(MotionsOfEssential(FitEssential(matches, samples.essential_iterations, rng).matrix));
  add(MotionsOfHomography(FitHomography(matches, samples.homography_iterations, rng).matrix,
                          matches));
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        // The faces and the corners of a cube.
        if (const int n = std::abs(x) + std::abs(y) + std::abs(z); n == 1 || n == 3)
          motions.push_back(
              {newest_from_first.rotation.conjugate(), Eigen::Vector3d(x, y, z).normalized()});
  return motions;
}

struct Solution {
  InverseDepthState state;
  double cost = std::numeric_limits<double>::infinity();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
};

class Beginner {
 public:
  Beginner(const Window& window, const WindowOptions& options, double length)
      : window_(window), options_(options), length_(length) {
    window_.unit = UnitLength{window_.images.front().id, window_.newest().id, length};
    window_.median_inverse_depth = 1;
    for (WindowPoint& p : window_.points) {
      p.inverse_depth = p.prior_inverse_depth = 1;
      p.prior_sigma = 1.5;  // from infinity to a quarter of the median depth
    }
    made_ = ProblemOf(window_, options_, true);
    made_.problem.least_inverse_depth = 0;
    first_ = made_.PoseOf(window_, window_.images.front().id);
    newest_ = made_.PoseOf(window_, window_.newest().id);
  }

  Solution Start(const BeginningMotion& motion) const {
    Solution s{made_.StateOf(window_)};
    const WindowImage &first = window_.images.front(), &newest = window_.newest();
    const Rigid3 from_first = first.cam_from_odom;
    const Eigen::AngleAxisd change(
        Eigen::Quaterniond(motion.first_from_newest.conjugate() *
                           (newest.cam_from_odom * from_first.Inverse()).rotation.conjugate()));
    for (size_t k = 0; k < s.state.poses.size(); ++k) {
      const WindowImage& image = window_.images[made_.images[k]];
      if (image.id == first.id) continue;
      const double share = (image.time_s - first.time_s) / (newest.time_s - first.time_s);
      const Eigen::Quaterniond rotation =
          Eigen::AngleAxisd(share * change.angle(), change.axis()) *
          Eigen::Quaterniond((image.cam_from_odom * from_first.Inverse()).rotation);
      const Rigid3 image_from_first(rotation, rotation * (-share * length_ * motion.direction));
      s.state.poses[k] = image_from_first * from_first;
    }
    constexpr double kDepths[] = {0.0, 0.3, 0.7, 1.2, 2.0, 3.5};  // about the median, which is 1
    SearchDepths(kDepths, std::vector<char>(made_.points.size(), true), made_.problem, s.state);
    return s;
  }

  void Improve(int iterations, Solution& s) const {
    s.cost = MinimizeInverseDepths(made_.problem, {.max_iterations = iterations, .tolerance = 1e-4},
                                   s.state)
                 .solver.cost;
    s.direction = (s.state.poses[first_] * s.state.poses[newest_].OriginInSource()).normalized();
  }

  // Squared sigmas.
  double Unit(const Solution& s) const {
    const double freedom = 2.0 * static_cast<double>(made_.problem.measurements.size()) -
                           static_cast<double>(made_.problem.points.size());
    return std::max(1e-9, s.cost / std::max(1.0, freedom));
  }

  double ShareBehind(const Solution& s) const {
    return static_cast<double>(
               std::ranges::count_if(s.state.inverse_depths, [](double d) { return d <= 0; })) /
           static_cast<double>(s.state.inverse_depths.size());
  }

  BeginningMotion MotionOf(const Solution& s) const {
    return {Eigen::Quaterniond((s.state.poses[newest_] * s.state.poses[first_].Inverse()).rotation)
                .conjugate(),
            s.direction};
  }

  // The window with this solution, the unit of length changed so that the median depth is 1.
  Window Made(Solution s) const {
    Window made = window_;
    // A last step from the minimum gives the variances there.
    const InverseDepthReport report =
        MinimizeInverseDepths(made_.problem, {.max_iterations = 1}, s.state);
    made_.Apply(s.state, made);
    std::vector<double> known;
    for (size_t k = 0; k < made_.points.size(); ++k) {
      WindowPoint& p = made.points[made_.points[k]];
      p.variance = report.variances[k];
      if (p.HasDepth()) known.push_back(p.inverse_depth);
    }
    constexpr size_t kLeast = 10;
    const double median =
        std::max(1e-3, Median(known.size() < kLeast ? s.state.inverse_depths : known));
    for (WindowImage& image : made.images) image.cam_from_odom.translation *= median;
    for (WindowPoint& p : made.points) {
      p.inverse_depth /= median;
      p.variance /= median * median;
      p.prior_inverse_depth = p.inverse_depth;
      p.prior_sigma = 1;
    }
    made.unit->length = length_ * median;
    for (WindowImage& image : made.images) image.median_inverse_depth = 1;
    return made;
  }

 private:
  Window window_;
  WindowOptions options_;
  double length_;
  WindowProblem made_;
  int first_ = 0, newest_ = 0;
};

// What is asked of all motions alike; nothing where there is too little parallax.
struct Given {
  RayMatches matches;
  Rigid3 newest_from_first;
  double parallax = 0;  // px, median
};

std::optional<Given> WhatIsGiven(const Window& window, const WindowOptions& options) {
  Given given{MatchesOf(window, options),
              window.newest().cam_from_odom * window.images.front().cam_from_odom.Inverse()};
  constexpr size_t kLeastImages = 4;
  if (given.matches.size() < kLeastMatches || window.images.size() < kLeastImages)
    return std::nullopt;
  given.parallax = MedianParallax(given.matches, given.newest_from_first);
  // Less than the noise of a track says nothing.
  return given.parallax < options.sigma_px ? std::nullopt : std::optional(std::move(given));
}

// The way that explains the parallax at a depth of 1; half of it at most.
double WayOf(const Given& given, const WindowOptions& options) {
  return std::min(0.5, given.parallax / options.focal_px);
}

}  // namespace

Beginning BeginMotion(const Window& window, const WindowOptions& options,
                      const BeginningOptions& beginning, double image_width, Rng& rng) {
  Beginning result{window};
  const std::optional<Given> given = WhatIsGiven(window, options);
  if (!given) return result;
  const Beginner beginner(window, options, WayOf(*given, options));
  std::vector<Solution> solutions;
  for (const BeginningMotion& motion :
       MotionsToTry(given->matches, given->newest_from_first, rng)) {
    Solution s = beginner.Start(motion);
    beginner.Improve(12, s);
    solutions.push_back(std::move(s));
  }
  std::ranges::stable_sort(solutions, {}, &Solution::cost);
  std::vector<Solution> distinct;
  for (Solution& s : solutions) {
    if (distinct.size() == kPolished) break;
    if (std::ranges::none_of(distinct, [&](const Solution& d) {
          return d.direction.dot(s.direction) > std::cos(kSameDirection);
        }))
      distinct.push_back(std::move(s));
  }
  for (Solution& s : distinct) beginner.Improve(20, s);
  std::ranges::stable_sort(distinct, {}, &Solution::cost);
  const Solution& best = distinct.front();
  const auto rival = std::ranges::find_if(distinct, [&](const Solution& s) {
    return s.direction.dot(best.direction) < std::cos(kSameDirection);
  });
  const double unit = beginner.Unit(best);
  const double gap = rival == distinct.end() ? std::numeric_limits<double>::infinity()
                                             : (rival->cost - best.cost) / unit;
  const double asked = beginning.least_parallax_px * image_width / 640;
  const bool is_late = window.newest().time_s - window.images.front().time_s > beginning.late_s;
  result.is_decided = given->parallax >= (is_late ? asked / 3 : asked) &&
                      gap > beginning.least_gap && unit < beginning.max_unit &&
                      beginner.ShareBehind(best) < beginning.max_behind;
  result.leader = beginner.MotionOf(best);
  result.window = beginner.Made(best);
  return result;
}

Beginning FollowLeader(const Window& window, const WindowOptions& options,
                       const BeginningMotion& leader) {
  Beginning result{window};
  const std::optional<Given> given = WhatIsGiven(window, options);
  if (!given) return result;
  const Beginner beginner(window, options, WayOf(*given, options));
  Solution s = beginner.Start(leader);
  beginner.Improve(12, s);
  result.leader = beginner.MotionOf(s);
  result.window = beginner.Made(std::move(s));
  return result;
}

}  // namespace oaslam
