#include "oaslam/odometry/restarts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "oaslam/estimation/two_view_models.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

constexpr double kLeastGain =
    15;  // squared sigmas, so that near equals do not alternate; not measured
constexpr int kIterations = 10;  // not measured

// Where the newest image might be.
struct Guess {
  Eigen::Quaterniond odom_from_cam;
  Eigen::Vector3d center;
};

Guess GuessOf(const Rigid3& cam_from_odom) {
  return {Eigen::Quaterniond(cam_from_odom.rotation.conjugate()), cam_from_odom.OriginInSource()};
}

Rigid3 PoseOf(const Guess& guess) {
  const Eigen::Quaterniond rotation = guess.odom_from_cam.conjugate();
  return Rigid3(Rigid3::Rotation(rotation), rotation * -guess.center);
}

// The velocity before an image, from the image two before it.
std::optional<Eigen::Vector3d> VelocityBefore(const Window& window, size_t junction) {
  if (junction == 0) return std::nullopt;
  const WindowImage &at = window.images[junction],
                    &before = window.images[junction < 2 ? 0 : junction - 2];
  return (at.cam_from_odom.OriginInSource() - before.cam_from_odom.OriginInSource()) /
         (at.time_s - before.time_s);
}

// The motions of the homography between two images, its plane at the median depth.
void AddMotionsOfPlane(const Window& window, const WindowImage& from, const WindowOptions& options,
                       Rng& rng, std::vector<Guess>& guesses) {
  constexpr int kLeast = 15, kSamples = 100;
  constexpr double kLeastShare = 0.4;  // of the matches: less is no plane
  RayMatches matches;
  matches.focal_first = matches.focal_second = options.focal_px;
  const int newest = window.newest().id;
  for (const WindowPoint& p : window.points) {
    if (p.sightings.empty() || p.sightings.back().image != newest) continue;
    const Eigen::Vector2d* ray = p.anchor == from.id ? &p.ray : nullptr;
    for (const Sighting& s : p.sightings)
      if (s.image == from.id) ray = &s.ray;
    if (!ray || from.id == newest) continue;
    matches.first.push_back(ray->homogeneous());
    matches.second.push_back(p.sightings.back().ray.homogeneous());
    matches.sigma.push_back(1);  // px: a plane of a room is not quite one
  }
  if (matches.size() < kLeast) return;
  const TwoViewModel homography = FitHomography(matches, kSamples, rng);
  int inliers = 0;
  for (int i = 0; i < matches.size(); ++i) {
    const Eigen::Vector3d moved = homography.matrix * matches.first[i];
    inliers += (moved.hnormalized() - matches.second[i].head<2>()).norm() * options.focal_px < 2;
  }
  if (inliers < kLeastShare * matches.size()) return;
  const Guess start = GuessOf(from.cam_from_odom);
  for (const Rigid3& motion : MotionsOfHomography(homography.matrix, matches))
    guesses.push_back({start.odom_from_cam * motion.rotation.conjugate(),
                       start.center + start.odom_from_cam * motion.OriginInSource() /
                                          std::max(1e-3, from.median_inverse_depth)});
}

class Restarter {
 public:
  Restarter(const WindowOptions& options, const Window& window)
      : options_(options),
        window_(window),
        made_(ProblemOf(window, options, true)),
        present_(made_.StateOf(window)) {}

  double CostOfState(const InverseDepthState& state) const {
    return CostOf(made_.problem, state, std::pow(options_.outlier_px / options_.sigma_px, 2));
  }

  // The images after the junction move towards the guess, the more the later they are; the points
  // that were first seen from there on get new depths.
  InverseDepthState Start(size_t junction, const Guess& guess) const {
    InverseDepthState state = present_;
    const WindowImage &from = window_.images[junction], &newest = window_.newest();
    const Guess now = GuessOf(newest.cam_from_odom), start = GuessOf(from.cam_from_odom);
    const Eigen::AngleAxisd change(now.odom_from_cam.conjugate() * guess.odom_from_cam);
    for (int k = 0; k < made_.problem.free_poses; ++k) {
      const WindowImage& image = window_.images[made_.images[k]];
      if (image.time_s <= from.time_s) continue;
      const double share = (image.time_s - from.time_s) / (newest.time_s - from.time_s);
      state.poses[k] = PoseOf({GuessOf(image.cam_from_odom).odom_from_cam *
                                   Eigen::AngleAxisd(share * change.angle(), change.axis()),
                               start.center + share * (guess.center - start.center)});
    }
    std::vector<char> is_searched(made_.points.size());
    for (size_t k = 0; k < made_.points.size(); ++k)
      is_searched[k] = window_.points[made_.points[k]].anchor >= from.id;
    std::vector<double> depths;
    for (const double d : {0.1, 0.3, 0.6, 1.0, 1.6, 2.5, 4.0})
      depths.push_back(d * from.median_inverse_depth);
    SearchDepths(depths, is_searched, made_.problem, state);
    return state;
  }

  void Improve(InverseDepthState& state) const {
    MinimizeInverseDepths(made_.problem, {.max_iterations = kIterations, .tolerance = 1e-4}, state);
  }

  const InverseDepthState& present() const { return present_; }
  const WindowProblem& made() const { return made_; }

 private:
  const WindowOptions& options_;
  const Window& window_;
  WindowProblem made_;
  InverseDepthState present_;
};

}  // namespace

RestartReport RestartWindow(const WindowOptions& options, Rng& rng, Window& window) {
  RestartReport report;
  std::vector<size_t> free;
  for (size_t i = 0; i < window.images.size(); ++i)
    if (!window.images[i].is_held) free.push_back(i);
  constexpr size_t kLeastFree = 4, kFreeForTwo = 7;  // fewer images do not tell solutions apart
  if (free.size() < kLeastFree) return report;
  std::vector<size_t> junctions{free.front()};
  if (free.size() >= kFreeForTwo) junctions.push_back(free[free.size() / 2]);

  const Restarter restarter(options, window);
  const double present_cost = restarter.CostOfState(restarter.present());
  InverseDepthState best = restarter.present();
  double best_cost = present_cost;
  const Guess now = GuessOf(window.newest().cam_from_odom);
  for (const size_t junction : junctions) {
    const WindowImage& from = window.images[junction];
    const double elapsed = window.newest().time_s - from.time_s;
    const auto velocity = VelocityBefore(window, junction);
    if (!velocity || !(elapsed > 0)) continue;
    const Eigen::Vector3d center = from.cam_from_odom.OriginInSource();
    std::vector<Guess> guesses{{now.odom_from_cam, center + elapsed * *velocity},
                               {now.odom_from_cam, center}};
    AddMotionsOfPlane(window, from, options, rng, guesses);
    const double way = std::max(elapsed * velocity->norm(), (now.center - center).norm());
    for (const Guess& guess : guesses) {
      // As near as this it ends where the window is now.
      constexpr double kSameAngle = 0.3 * kDegree, kSameStep = 0.2;
      if (now.odom_from_cam.angularDistance(guess.odom_from_cam) < kSameAngle &&
          (guess.center - now.center).norm() < kSameStep * way)
        continue;
      InverseDepthState state = restarter.Start(junction, guess);
      restarter.Improve(state);
      const double cost = restarter.CostOfState(state);
      ++report.tried;
      if (cost < best_cost - kLeastGain) {
        best = std::move(state);
        best_cost = cost;
        report.is_changed = true;
      }
    }
  }
  if (report.is_changed) restarter.made().Apply(best, window);
  return report;
}

}  // namespace oaslam
