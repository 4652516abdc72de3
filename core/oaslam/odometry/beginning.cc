#include "oaslam/odometry/beginning.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/odometry/inverse_depth_solver.h"
#include "oaslam/odometry/two_images.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr double kSameDirection = 8 * kDegree;  // of translation: the same minimum
constexpr int kPolished = 6;                    // at most, until two of them are distinct

// How the camera moved from the first image to the newest, but for the length of the way.
struct BeginningMotion {
  Eigen::Quaterniond first_from_newest;
  Eigen::Vector3d direction;  // of the newest camera in the frame of the first, length 1
};

BeginningMotion MotionOf(const Rigid3& newest_from_first) {
  return {Eigen::Quaterniond(newest_from_first.rotation).conjugate(),
          newest_from_first.OriginInSource().normalized()};
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
  // Samples of 8 and of 4. They find a model in 95 % of cases where 56 % and 38 % are inliers.
  constexpr int kOfEssential = 300, kOfHomography = 150;
  std::vector<BeginningMotion> motions;
  for (const Rigid3& m : MotionsBetween(matches, kOfEssential, kOfHomography, rng))
    motions.push_back(MotionOf(m));
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        // The faces and the corners of a cube.
        if (const int n = std::abs(x) + std::abs(y) + std::abs(z); n == 1 || n == 3)
          motions.push_back(
              {newest_from_first.rotation.conjugate(), Eigen::Vector3d(x, y, z).normalized()});
  return motions;
}

// Of the points whose depth is known, or of all where these are few.
double MedianInverseDepth(const Window& window) {
  constexpr size_t kLeast = 10;
  std::vector<double> known, all;
  for (const WindowPoint& p : window.points) {
    all.push_back(p.inverse_depth);
    if (p.HasDepth()) known.push_back(p.inverse_depth);
  }
  return std::max(1e-3, Median(known.size() < kLeast ? std::move(all) : std::move(known)));
}

// The median ratio of the inverse depths that two windows know; where they share few points, as if
// the median depth had stayed.
double DepthsOverThose(const Window& now, const Window& before) {
  constexpr size_t kLeast = 10;
  using Key = std::tuple<int, float, float>;
  const auto key_of = [](const WindowPoint& p) {
    return Key(p.anchor, p.anchor_px.x(), p.anchor_px.y());
  };
  std::map<Key, double> known;
  for (const WindowPoint& p : before.points)
    if (p.HasDepth()) known[key_of(p)] = p.inverse_depth;
  std::vector<double> ratios;
  for (const WindowPoint& p : now.points)
    if (const auto found = known.find(key_of(p)); p.HasDepth() && found != known.end())
      ratios.push_back(p.inverse_depth / found->second);
  return ratios.size() < kLeast ? MedianInverseDepth(now) : Median(std::move(ratios));
}

// The unit of a beginning, in the unit that it was made in: that of the window before, drawn slowly
// towards the median depth. Of a camera that only turns, depths are noise, and a chain of their
// ratios alone wanders by a factor of four in as many seconds (fr1/rpy).
double UnitOf(const Window& now, const Window* before) {
  constexpr double kShare = 0.1;  // of each comparison; .05 and .2 are as good
  const double median = MedianInverseDepth(now);
  return before ? std::pow(DepthsOverThose(now, *before), 1 - kShare) * std::pow(median, kShare)
                : median;
}

// Multiplies all lengths; the first image stays.
void ScaleAboutFirst(double factor, Window& window) {
  const Rigid3 first = window.images.front().cam_from_odom;
  for (WindowImage& image : window.images) {
    Rigid3 image_from_first = image.cam_from_odom * first.Inverse();
    image_from_first.translation *= factor;
    image.cam_from_odom = image_from_first * first;
  }
  for (WindowPoint& p : window.points) {
    p.inverse_depth /= factor;
    p.variance /= factor * factor;
  }
  window.unit->length *= factor;
}

struct Solution {
  InverseDepthState state;
  double cost = std::numeric_limits<double>::infinity();
  bool is_settled = false;                  // as in MinimizationReport
  double damping = SchurOptions().damping;  // with which the next one begins
  double outliers = 1;                      // share of the sightings; known of polished solutions
  BeginningMotion motion{};
};

bool AreDistinct(const Solution& a, const Solution& b) {
  return a.motion.direction.dot(b.motion.direction) < std::cos(kSameDirection);
}

class Beginner {
 public:
  Beginner(const Window& window, const WindowOptions& options, double length)
      : window_(window), options_(options), length_(length) {
    window_.unit = UnitLength{window_.images.front().id, window_.newest().id, length};
    window_.median_inverse_depth = 1;
    for (WindowPoint& p : window_.points) {
      p.inverse_depth = p.prior_inverse_depth = 1;
      // Next to nothing: the way is a guess by the parallax, which a rotation can take away. Depths
      // that are held near the guess turn the direction by up to 40 degrees.
      p.prior_sigma = 20;
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
    SearchDepths(1, made_.problem, s.state);
    return s;
  }

  // Two calls are the same as one with the sum of their iterations.
  void Improve(int iterations, Solution& s) {
    if (s.is_settled) return;
    const MinimizationReport report =
        solver_
            .Minimize(made_.problem,
                      {.max_iterations = iterations, .tolerance = 1e-4, .damping = s.damping},
                      s.state)
            .solver;
    s.cost = report.cost;
    s.is_settled = report.is_settled;
    s.damping = report.damping;
    s.motion = MotionOf(s.state.poses[newest_] * s.state.poses[first_].Inverse());
  }

  // Without the sightings that do not fit. In the cost each of these counts as much as one that
  // hardly fits, so that solutions with different ones can be compared.
  void Polish(Solution& s) {
    constexpr int kRounds = 2, kIterations = 10;
    InverseDepthProblem problem = made_.problem;
    for (int round = 0; round < kRounds; ++round) {
      FlagOutliers(s.state, problem);
      solver_.Minimize(problem, {.max_iterations = kIterations, .tolerance = 1e-4}, s.state);
    }
    s.outliers = FlagOutliers(s.state, problem);
    s.cost = CostOf(problem, s.state, std::pow(options_.outlier_px / options_.sigma_px, 2));
    s.motion = MotionOf(s.state.poses[newest_] * s.state.poses[first_].Inverse());
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

  // The window with this solution, in the unit of the one before.
  Window Made(Solution s, const Window* before) {
    Window made = window_;
    // A last step from the minimum gives the variances there.
    const InverseDepthReport report =
        solver_.Minimize(made_.problem, {.max_iterations = 1}, s.state);
    made_.Apply(s.state, made);
    for (size_t k = 0; k < made_.points.size(); ++k)
      made.points[made_.points[k]].variance = report.variances[k];
    ScaleAboutFirst(UnitOf(made, before), made);
    const double median = MedianInverseDepth(made);
    made.median_inverse_depth = median;
    for (WindowImage& image : made.images) image.median_inverse_depth = median;
    for (WindowPoint& p : made.points) {
      p.prior_inverse_depth = p.inverse_depth;
      p.prior_sigma = median;
    }
    return made;
  }

 private:
  // Returns the share of outliers.
  double FlagOutliers(const InverseDepthState& state, InverseDepthProblem& problem) const {
    int outliers = 0;
    for (DepthMeasurement& m : problem.measurements) {
      const DepthPrior& p = problem.points[m.point];
      const Eigen::Vector3d x = ScaledPoint(state.poses[m.pose] * state.poses[p.anchor].Inverse(),
                                            p.ray, state.inverse_depths[m.point]);
      m.is_outlier =
          x.z() < kNearest ||
          (m.root_information * (x.head<2>() / x.z() - m.ray)).norm() * options_.sigma_px >
              options_.outlier_px;
      outliers += m.is_outlier;
    }
    return outliers / static_cast<double>(problem.measurements.size());
  }

  Window window_;
  WindowOptions options_;
  double length_;
  WindowProblem made_;
  InverseDepthSolver solver_;
  int first_ = 0, newest_ = 0;
};

// What is asked of all motions alike; nothing where there is too little parallax.
struct Given {
  RayMatches matches;
  Rigid3 newest_from_first;
  double parallax = 0;  // px, median
};

std::optional<Given> WhatIsGiven(const Window& window, const WindowOptions& options) {
  Given given{MatchesBetween(window, window.images.front().id, window.newest().id, options),
              window.newest().cam_from_odom * window.images.front().cam_from_odom.Inverse()};
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

// The starts, each improved as long as it may still be among the best, by their cost.
std::vector<Solution> SolutionsOf(Beginner& beginner, std::span<const BeginningMotion> starts) {
  // Where a start is after four iterations tells whether it gets anywhere (docs/lab/odometry.md).
  constexpr int kFirst = 4, kIterations = 12;
  constexpr size_t kLeast = 10;
  constexpr double kMostCost = 4;  // times that of the best
  std::vector<Solution> solutions;
  for (const BeginningMotion& motion : starts) {
    solutions.push_back(beginner.Start(motion));
    beginner.Improve(kFirst, solutions.back());
  }
  std::ranges::stable_sort(solutions, {}, &Solution::cost);
  while (solutions.size() > kLeast && solutions.back().cost > kMostCost * solutions.front().cost)
    solutions.pop_back();
  for (Solution& s : solutions) beginner.Improve(kIterations - kFirst, s);
  std::ranges::stable_sort(solutions, {}, &Solution::cost);
  return solutions;
}

// The best solution and, if there is one, the best that is distinct from it.
std::vector<Solution> BestTwo(Beginner& beginner, const Given& given, Rng& rng) {
  std::vector<Solution> solutions =
      SolutionsOf(beginner, MotionsToTry(given.matches, given.newest_from_first, rng));
  std::vector<Solution> tried, distinct;
  const auto is_new = [](const Solution& s, const std::vector<Solution>& others) {
    return std::ranges::all_of(others, [&](const Solution& o) { return AreDistinct(o, s); });
  };
  for (Solution& s : solutions) {
    if (tried.size() == kPolished) break;
    if (!is_new(s, tried)) continue;
    tried.push_back(s);
    beginner.Polish(s);
    const auto same =
        std::ranges::find_if(distinct, [&](const Solution& d) { return !AreDistinct(d, s); });
    if (same == distinct.end())
      distinct.push_back(std::move(s));
    else if (s.cost < same->cost)
      *same = std::move(s);
  }
  std::ranges::stable_sort(distinct, {}, &Solution::cost);
  if (distinct.size() > 2) distinct.resize(2);
  return distinct;
}

}  // namespace

int MatchesOfFirst(const Window& window) {
  return MatchesBetween(window, window.images.front().id, window.newest().id, {}).size();
}

Beginning BeginMotion(const Window& window, const Window* before, const WindowOptions& options,
                      const BeginningOptions& beginning, double image_width, Rng& rng) {
  Beginning result{window};
  const std::optional<Given> given = WhatIsGiven(window, options);
  if (!given) return result;
  Beginner beginner(window, options, WayOf(*given, options));
  const std::vector<Solution> found = BestTwo(beginner, *given, rng);
  const Solution& best = found.front();
  const double unit = beginner.Unit(best);
  const double gap = found.size() < 2 ? std::numeric_limits<double>::infinity()
                                      : (found[1].cost - best.cost) / unit;
  const double asked = beginning.least_parallax_px * image_width / 640;
  const bool is_late = window.newest().time_s - window.images.front().time_s > beginning.late_s;
  result.is_known = true;
  result.is_decided = given->parallax >= (is_late ? asked / 3 : asked) &&
                      gap > beginning.least_gap && best.outliers < beginning.max_outliers &&
                      beginner.ShareBehind(best) < beginning.max_behind;
  result.window = beginner.Made(best, before);
  return result;
}

Beginning FollowLeader(const Window& window, const Window& before, const WindowOptions& options) {
  Beginning result{window};
  const std::optional<Given> given = WhatIsGiven(window, options);
  if (!given) return result;
  Beginner beginner(window, options, WayOf(*given, options));
  Solution s = beginner.Start(
      MotionOf(before.newest().cam_from_odom * before.images.front().cam_from_odom.Inverse()));
  beginner.Improve(12, s);
  result.is_known = true;
  result.window = beginner.Made(std::move(s), &before);
  return result;
}

}  // namespace oaslam
