#include "oaslam/objects/upright.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// The roll of a hand-held camera is independent once the view has changed by this much.
constexpr double kNewView = 15 * kDegree;
constexpr double kLeastRoll = 3 * kDegree;  // no hand keeps a camera more level over a few views
constexpr double kMaxRoll = 20 * kDegree;   // a view with more roll is not held level
// Least share of views held level; with fewer, the camera is not carried upright.
constexpr double kMinLevelShare = 0.8;
// A less certain vertical would exclude right poses in relocalization.
constexpr double kMaxSigma = 6 * kDegree;
// Least ratio of the variance of the axes by turning to that by rolling; below it the camera turned
// too little for the plane of its axes to be determined.
constexpr double kMinRatio = 8;
// Angle covered by the level axes: a turn this wide is not made by the wrist.
constexpr double kWideTurn = 150 * kDegree;
// Bounds on the median angle between optical axis and horizon: for a steeper camera a narrow turn
// may be a roll.
constexpr double kMaxPitch = 50 * kDegree, kMaxPitchOfWideTurn = 75 * kDegree;
// Least median downward pitch that decides which side of a turned image is up.
constexpr double kMinDownPitch = 10 * kDegree;

struct LevelFit {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  // sign not yet known
  double roll = 0;         // sine, root mean square over the views that are level
  double level_share = 0;  // of views with a roll below kMaxRoll
  double spread = 0;       // variance of the axes in the direction in which they vary second most
  double ratio = 0;        // of that to the variance along `up`
  double coverage = 0;     // rad, of the circle about `up`, by the axes that are level
};

// Directions spread evenly over half a sphere (Fibonacci's lattice).
std::vector<Eigen::Vector3d> Hemisphere(int count) {
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = (i + 0.5) / count, r = std::sqrt(1 - z * z);
    directions.emplace_back(r * std::cos(golden_angle * i), r * std::sin(golden_angle * i), z);
  }
  return directions;
}

// The direction to which most axes are orthogonal, coarsely.
Eigen::Vector3d RoughNormal(std::span<const Eigen::Vector3d> axes) {
  constexpr int kDirections = 600;  // some 6 degrees apart, near enough for the fit to converge
  static const std::vector<Eigen::Vector3d> directions = Hemisphere(kDirections);
  double least = std::numeric_limits<double>::infinity();
  Eigen::Vector3d best = directions.front();
  for (const Eigen::Vector3d& d : directions) {
    double cost = 0;
    for (const Eigen::Vector3d& axis : axes) {
      const double roll = axis.dot(d);
      cost += std::min(roll * roll, kMaxRoll * kMaxRoll);
    }
    if (cost >= least) continue;
    least = cost;
    best = d;
  }
  return best;
}

// Robust standard deviation of the rolls (median absolute deviation).
double SpreadOf(std::span<const Eigen::Vector3d> axes, const Eigen::Vector3d& up) {
  std::vector<double> rolls;
  for (const Eigen::Vector3d& axis : axes) rolls.push_back(std::abs(axis.dot(up)));
  return 1.4826 * Median(std::move(rolls));
}

// Fits the direction to which the axes are orthogonal, by iteratively reweighted least squares with
// Cauchy's kernel.
LevelFit FitLevel(std::span<const Eigen::Vector3d> axes) {
  constexpr int kIterations = 10;
  constexpr double kKernel = 2.385;  // times the standard deviation: 95 % efficiency
  LevelFit fit;
  fit.up = RoughNormal(axes);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const double scale = kKernel * std::max(SpreadOf(axes, fit.up), kLeastRoll);
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    double weights = 0;
    for (const Eigen::Vector3d& axis : axes) {
      const double ratio = axis.dot(fit.up) / scale, weight = 1 / (1 + ratio * ratio);
      moment += weight * axis * axis.transpose();
      weights += weight;
    }
    const auto [values, vectors] = EigenOfSymmetric(Eigen::Matrix3d(moment / weights));
    fit.up = vectors.col(0);
    fit.spread = values[1];
    fit.ratio = values[1] / std::max(values[0], 1e-12);
  }
  constexpr int kSectors = 24;  // of 15 degrees, as kNewView
  const Eigen::Vector3d east = fit.up.unitOrthogonal(), north = fit.up.cross(east);
  std::array<bool, kSectors> seen{};
  double level = 0, squares = 0;
  for (const Eigen::Vector3d& axis : axes) {
    const double roll = axis.dot(fit.up);
    if (std::abs(roll) > std::sin(kMaxRoll)) continue;
    ++level;
    squares += roll * roll;
    const double turn =
        (std::atan2(axis.dot(north), axis.dot(east)) + std::numbers::pi) / (2 * std::numbers::pi);
    seen[std::min(static_cast<int>(turn * kSectors), kSectors - 1)] = true;
  }
  fit.coverage =
      2 * std::numbers::pi / kSectors * static_cast<double>(std::ranges::count(seen, true));
  fit.level_share = level / static_cast<double>(axes.size());
  fit.roll = level > 0 ? std::sqrt(squares / level) : 1;
  return fit;
}

double AngleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::acos(std::clamp(((a * b.transpose()).trace() - 1) / 2, -1.0, 1.0));
}

int CountViews(std::span<const Eigen::Matrix3d> cameras) {
  int views = 1;
  const Eigen::Matrix3d* last = &cameras.front();
  for (const Eigen::Matrix3d& camera : cameras) {
    if (AngleBetween(camera, *last) < kNewView) continue;
    last = &camera;
    ++views;
  }
  return views;
}

std::vector<double> Sines(std::span<const Eigen::Matrix3d> cameras, int row,
                          const Eigen::Vector3d& up) {
  std::vector<double> sines;
  for (const Eigen::Matrix3d& camera : cameras) sines.push_back(camera.row(row).dot(up));
  return sines;
}

// The vertical, if the axes `row` of the cameras are level and determine it, and the angle they
// cover around it.
struct LevelAxes {
  std::optional<Upright> upright;
  double coverage = 0;
};

LevelAxes FromLevelAxes(std::span<const Eigen::Matrix3d> cameras, int row) {
  std::vector<Eigen::Vector3d> axes;
  for (const Eigen::Matrix3d& camera : cameras) axes.emplace_back(camera.row(row).transpose());
  const LevelFit fit = FitLevel(axes);
  const double sigma = std::max(fit.roll, kLeastRoll) / std::sqrt(CountViews(cameras) * fit.spread);
  if (fit.level_share < kMinLevelShare || fit.ratio < kMinRatio || sigma > kMaxSigma) return {};
  std::vector<double> forward = Sines(cameras, 2, fit.up);
  const double down = -Median(forward);
  for (double& sine : forward) sine = std::abs(sine);
  if (Median(forward) > std::sin(fit.coverage < kWideTurn ? kMaxPitch : kMaxPitchOfWideTurn))
    return {};
  // For an image that is turned by 90 degrees, only the fact that people look down tells which side
  // is up.
  const bool is_turned = row == 1;
  if (is_turned && (fit.coverage < kWideTurn || std::abs(down) < std::sin(kMinDownPitch)))
    return {};
  const double side = is_turned ? down : -Median(Sines(cameras, 1, fit.up));
  return {Upright{side < 0 ? Eigen::Vector3d(-fit.up) : fit.up, sigma}, fit.coverage};
}

}  // namespace

std::optional<Upright> UprightOf(std::span<const Eigen::Matrix3d> cameras) {
  constexpr size_t kMinCameras = 5;  // fewer do not tell a turn from a roll
  if (cameras.size() < kMinCameras) return std::nullopt;
  const LevelAxes x = FromLevelAxes(cameras, 0), y = FromLevelAxes(cameras, 1);
  return y.coverage > x.coverage ? y.upright : x.upright;
}

std::optional<Upright> UprightFromGravity(std::span<const GravityView> views) {
  constexpr size_t kMinViews = 3;  // so that one shaken view is outvoted
  constexpr int kIterations = 10;
  // Standard deviation of the relative change of length that the motion of a hand adds to gravity.
  constexpr double kSteadyLength = 0.03;
  constexpr double kLeastSpread = 1 * kDegree;  // error of a good sensor and its mounting
  // A larger spread means that there is no common vertical.
  constexpr double kMaxSpread = 25 * kDegree;
  if (views.size() < kMinViews) return std::nullopt;
  std::vector<double> lengths;
  for (const GravityView& view : views) lengths.push_back(view.gravity_in_cam.norm());
  const double length = Median(lengths);
  std::vector<Eigen::Vector3d> ups;
  std::vector<double> steadiness;
  for (const GravityView& view : views) {
    const double shaken = (view.gravity_in_cam.norm() / length - 1) / kSteadyLength;
    ups.push_back(-(view.cam_from_world.transpose() * view.gravity_in_cam).normalized());
    steadiness.push_back(1 / (1 + shaken * shaken));
  }
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < ups.size(); ++i) up += steadiness[i] * ups[i];
  double spread = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    up.normalize();
    std::vector<double> angles;
    for (const Eigen::Vector3d& u : ups)
      angles.push_back(std::acos(std::clamp(u.dot(up), -1.0, 1.0)));
    spread = std::max(Median(angles), kLeastSpread);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < ups.size(); ++i)
      sum += steadiness[i] / (1 + angles[i] * angles[i] / (spread * spread)) * ups[i];
    up = sum;
  }
  if (!(up.norm() > 0) || spread > kMaxSpread) return std::nullopt;
  return Upright{up.normalized(), spread / std::sqrt(static_cast<double>(views.size()))};
}

void UpdateUp(Map& map) {
  constexpr size_t kEnough = 200;      // keyframes used, evenly spaced, which bounds the time
  constexpr int kEnoughMeasured = 20;  // their mean is as good as the mounting of the sensor
  const auto stride = static_cast<uint32_t>(map.keyframes.size() / kEnough + 1);
  std::vector<Eigen::Matrix3d> cameras;
  std::vector<GravityView> measured;
  const uint32_t first = map.keyframes.empty() ? 0 : map.keyframes.First().value;
  for (uint32_t id = first; id < map.keyframes.Bound().value; id += stride) {
    const Keyframe* keyframe = map.keyframes.Find(KeyframeId(id));
    if (!keyframe) continue;
    cameras.push_back(keyframe->cam_from_world.rotation.toRotationMatrix());
    if (keyframe->gravity_in_cam) measured.push_back({cameras.back(), *keyframe->gravity_in_cam});
  }
  const auto count = static_cast<int>(measured.size() * stride);  // of all keyframes, about
  if (count >= std::min(map.up_keyframes, kEnoughMeasured))
    if (const auto upright = UprightFromGravity(measured)) {
      map.up = upright->up;
      map.up_keyframes = count;
      return;
    }
  if (map.up_keyframes > 0) return;
  const auto upright = UprightOf(cameras);
  // Map::up is reset where later views contradict it.
  map.up = upright ? std::optional(upright->up) : std::nullopt;
}

}  // namespace oaslam
