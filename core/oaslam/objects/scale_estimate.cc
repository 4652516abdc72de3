#include "oaslam/objects/scale_estimate.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/objects/object_model.h"
#include "oaslam/objects/usual_sizes.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// All scales are logarithms of metres per unit, all sigmas and variances those of logarithms.

// Boxes of a detector are all a little too wide, or too narrow; no ellipsoid of an object is
// better.
constexpr double kBoxSigma = .05;
// What all objects of a map have in common: the detector's boxes, and whose things they are.
constexpr double kCommonSigma = .05;
// How alike the deviations are of the three sides of a thing, and of the things of one class in one
// place, where they were bought together.
constexpr double kAlike = .5;
// The share of objects, and of whole classes, that are not what their label says, or only half
// seen.
constexpr double kOtherObject = .15, kOtherClass = .1;
// Such a thing may be anything from a twentieth to twenty times the size.
const double kOtherDensity = 1 / (2 * std::log(20.0));
// Beyond so many sigmas an object does not agree.
constexpr double kAgree = 2.5;
// Width and height of a whole thing agree better than this, in sigmas.
constexpr double kWhole = 3;
constexpr int kLeastObjects = 3, kLeastClasses = 3;
// The answer is the mean of the scales that are so near to the most likely one. It is refused where
// the scales within so many sigmas of the most likely one alone have less than this probability:
// two units that are near would else be one answer.
constexpr double kNear = .4, kSameAnswer = 3, kLeastProbability = .95;
// As high as a tall man can hold a camera (DIN 33402-2: his fist reaches 2.2 m).
constexpr double kReach_m = 2.2;
// The landmarks of a floor are within this share of its depth below the camera, and are this share
// of all that are in view.
constexpr double kThicknessOfFloor = .1, kOnFloor = .02;
constexpr size_t kEnoughLandmarks = 200;
// A vertical that follows from how the camera was held may be off by so much: three times the
// standard deviation up to which it is accepted (objects/upright).
constexpr double kMostTilt = 18 * std::numbers::pi / 180;

double Gaussian(double x, double variance) {
  return std::exp(-.5 * x * x / variance) / std::sqrt(2 * std::numbers::pi * variance);
}

// What one object says about the scale.
struct Witness {
  int category_id = 0;
  double scale = 0;
  double class_variance = 0;  // of the sizes of its class
  double own_variance = 0;    // of its ellipsoid

  double Variance() const { return class_variance + own_variance; }
};

using Witnesses = std::vector<Witness>;

// The axes of an object in the world, in the order length, depth, height of its class.
Eigen::Matrix3d AxesOf(const Ellipsoid& ellipsoid, const UsualSize& size,
                       const Eigen::Vector3d& up) {
  const Eigen::Matrix3d scaled = ScaledAxes(ellipsoid);
  const Eigen::Matrix3d shape = scaled * scaled.transpose();
  if (size.lies_anyhow) {
    return EigenOfSymmetric(shape).vectors.rowwise().reverse();
  }
  const Eigen::Vector3d level = up.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> ground;
  ground << level, up.cross(level);
  const Eigen::Matrix2d shadow = ground.transpose() * shape * ground;
  const SymmetricEigen<2> sorted = EigenOfSymmetric(shadow);
  Eigen::Matrix3d axes;
  axes << ground * sorted.vectors.col(1), ground * sorted.vectors.col(0), up;
  return axes;
}

// How much each side adds to the extent of a solid along a direction.
Eigen::Vector3d SharesOfSides(Solid solid, const Eigen::Vector3d& sides_along) {
  switch (solid) {
    case Solid::kBox:
      return sides_along;
    case Solid::kCylinder: {
      const double across = std::max(sides_along.head<2>().norm(), 1e-12);
      return {sides_along.x() * sides_along.x() / across,
              sides_along.y() * sides_along.y() / across, sides_along.z()};
    }
    case Solid::kBall:
      return sides_along.cwiseAbs2() / std::max(sides_along.norm(), 1e-12);
  }
  return sides_along;
}

// Width and height of an object in the images that showed it: of its ellipsoid, and of a thing of
// the usual size at its place.
struct Extents {
  Eigen::Vector2d scale = Eigen::Vector2d::Zero();  // log of the usual extent / the ellipsoid's
  // How much the logarithm of an extent changes with those of the usual sides, and of the
  // ellipsoid's half axes.
  Eigen::Matrix<double, 2, 3> by_sides = Eigen::Matrix<double, 2, 3>::Zero();
  Eigen::Matrix<double, 2, 3> by_half_axes = Eigen::Matrix<double, 2, 3>::Zero();
};

std::optional<Extents> MeanExtents(const Ellipsoid& ellipsoid, const UsualSize& size,
                                   const Eigen::Vector3d& up, std::span<const BoxView> views) {
  const Eigen::Matrix3d axes = AxesOf(ellipsoid, size, up), scaled = ScaledAxes(ellipsoid);
  const Eigen::Vector3d sides(size.length.Median(), size.depth.Median(), size.height.Median());
  Extents sum;
  int count = 0;
  for (const BoxView& view : views) {
    const Eigen::Vector3d center = view.cam_from_world * ellipsoid.center;
    if (center.z() <= 0) continue;
    const Eigen::Vector3d sight = center.normalized(),
                          right = Eigen::Vector3d::UnitY().cross(sight).normalized(),
                          down = sight.cross(right);
    const Eigen::Matrix3d world_from_cam =
        view.cam_from_world.rotation.conjugate().toRotationMatrix();
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector3d direction = world_from_cam * (i == 0 ? right : down);
      const Eigen::Vector3d shares =
          SharesOfSides(size.solid, (axes.transpose() * direction).cwiseAbs().cwiseProduct(sides));
      const Eigen::Vector3d half = (scaled.transpose() * direction).cwiseAbs2();
      sum.scale[i] += std::log(shares.sum() / (2 * std::sqrt(half.sum())));
      sum.by_sides.row(i) += shares.transpose() / shares.sum();
      sum.by_half_axes.row(i) += half.transpose() / half.sum();
    }
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Extents{sum.scale / count, sum.by_sides / count, sum.by_half_axes / count};
}

Eigen::Matrix3d CovarianceOfSides(const UsualSize& size) {
  const Eigen::Vector3d sigmas(size.length.LogSigma(), size.depth.LogSigma(),
                               size.height.LogSigma());
  const Eigen::Matrix3d alike =
      Eigen::Matrix3d::Constant(kAlike) + (1 - kAlike) * Eigen::Matrix3d::Identity().eval();
  return sigmas.asDiagonal() * alike * sigmas.asDiagonal();
}

// Nothing where the ellipsoid is not that of a whole thing of this class.
std::optional<Witness> WitnessOf(const Map& map, const Object& object, const UsualSize& size) {
  const std::vector<BoxView> views = ViewsOf(map, object.observations);
  const auto extents = MeanExtents(object.ellipsoid, size, *map.up, views);
  if (!extents) return std::nullopt;
  const Eigen::Matrix2d of_class =
      extents->by_sides * CovarianceOfSides(size) * extents->by_sides.transpose();
  const Eigen::Matrix2d own = extents->by_half_axes * object.covariance.block<3, 3>(3, 3) *
                                  extents->by_half_axes.transpose() +
                              kBoxSigma * kBoxSigma * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d both = of_class + own;
  const double difference = extents->scale[0] - extents->scale[1];
  const double variance_of_difference = both(0, 0) + both(1, 1) - 2 * both(0, 1);
  if (difference * difference > kWhole * kWhole * variance_of_difference) return std::nullopt;
  const Eigen::Matrix2d information = both.inverse();
  Eigen::Vector2d weights = information.rowwise().sum().cwiseMax(0);
  weights /= weights.sum();
  return Witness{object.category_id, weights.dot(extents->scale), weights.dot(of_class * weights),
                 weights.dot(own * weights)};
}

Witnesses WitnessesOf(const Map& map, const std::map<int, std::string>& names) {
  Witnesses witnesses;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    const auto name = names.find(object.category_id);
    const UsualSize* size = name == names.end() ? nullptr : FindUsualSize(name->second);
    if (!size) return;
    if (const auto witness = WitnessOf(map, object, *size)) witnesses.push_back(*witness);
  });
  return witnesses;
}

std::set<int> ClassesOf(const Witnesses& witnesses) {
  std::set<int> classes;
  for (const Witness& witness : witnesses) classes.insert(witness.category_id);
  return classes;
}

// Those of these classes, or those of all others.
Witnesses Chosen(const Witnesses& witnesses, const std::set<int>& classes, bool are_in) {
  Witnesses chosen;
  for (const Witness& witness : witnesses)
    if (classes.contains(witness.category_id) == are_in) chosen.push_back(witness);
  return chosen;
}

// Scales at equal distances, and what is said of each.
constexpr double kStep = .01;

struct Grid {
  double first = 0;
  size_t size = 0;

  double At(size_t i) const { return first + kStep * static_cast<double>(i); }
};

// Convolves a function on the grid, which goes on with the values at its ends, with a Gaussian.
std::vector<double> Smoothed(const std::vector<double>& values, double variance) {
  const int reach = std::max(1, static_cast<int>(std::ceil(4 * std::sqrt(variance) / kStep)));
  std::vector<double> kernel;
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) sum += kernel.emplace_back(Gaussian(k * kStep, variance));
  const int last = static_cast<int>(values.size()) - 1;
  std::vector<double> smooth(values.size(), 0);
  for (int i = 0; i <= last; ++i)
    for (int k = -reach; k <= reach; ++k)
      smooth[static_cast<size_t>(i)] += kernel[static_cast<size_t>(k + reach)] / sum *
                                        values[static_cast<size_t>(std::clamp(i + k, 0, last))];
  return smooth;
}

// Log-likelihood of each scale by the objects of one class. Their sizes differ from the usual one
// together, as things of one household do, and each by itself.
std::vector<double> LogLikelihoodOfClass(const Witnesses& same_class, const Grid& grid) {
  std::vector<double> log_each(grid.size, 0);
  double class_variance = 0;
  for (const Witness& witness : same_class) {
    class_variance += witness.class_variance / static_cast<double>(same_class.size());
    const double variance = witness.own_variance + (1 - kAlike) * witness.class_variance;
    for (size_t i = 0; i < grid.size; ++i)
      log_each[i] += std::log((1 - kOtherObject) * Gaussian(witness.scale - grid.At(i), variance) +
                              kOtherObject * kOtherDensity);
  }
  const double largest = std::ranges::max(log_each);
  for (double& value : log_each) value = std::exp(value - largest);
  std::vector<double> likelihood = Smoothed(log_each, kAlike * class_variance);
  const double other =
      std::exp(static_cast<double>(same_class.size()) * std::log(kOtherDensity) - largest);
  for (double& value : likelihood)
    value = std::log((1 - kOtherClass) * value + kOtherClass * other);
  return likelihood;
}

struct Posterior {
  double mode = 0, mean = 0, sigma = 0;
  double probability = 0;  // that the scale is the one at the mode
};

// The standard deviation of the Gaussian with the curvature of a log-likelihood at its maximum.
double SigmaAtMode(const std::vector<double>& log_likelihood, size_t mode) {
  constexpr size_t kSide = 4;  // in steps of the grid
  mode = std::clamp(mode, kSide, log_likelihood.size() - 1 - kSide);
  const double fall =
      2 * log_likelihood[mode] - log_likelihood[mode - kSide] - log_likelihood[mode + kSide];
  return kStep * kSide / std::sqrt(std::max(fall, 1e-9));
}

Posterior PosteriorOf(const Witnesses& witnesses) {
  const auto [least, most] = std::ranges::minmax(witnesses, {}, &Witness::scale);
  const Grid grid{least.scale - 1,
                  static_cast<size_t>(std::ceil((most.scale - least.scale + 2) / kStep))};
  std::vector<double> log_likelihood(grid.size, 0);
  for (const int category_id : ClassesOf(witnesses)) {
    const std::vector<double> of_class =
        LogLikelihoodOfClass(Chosen(witnesses, {category_id}, true), grid);
    for (size_t i = 0; i < grid.size; ++i) log_likelihood[i] += of_class[i];
  }
  const auto best = std::ranges::max_element(log_likelihood);
  const auto mode = static_cast<size_t>(best - log_likelihood.begin());
  const double same_answer = std::min(kNear, kSameAnswer * SigmaAtMode(log_likelihood, mode));
  Posterior posterior;
  posterior.mode = grid.At(mode);
  double all = 0, same = 0, near = 0, first = 0, second = 0;
  for (size_t i = 0; i < grid.size; ++i) {
    const double weight = std::exp(log_likelihood[i] - *best);
    const double offset = grid.At(i) - posterior.mode;
    all += weight;
    if (std::abs(offset) <= same_answer) same += weight;
    if (std::abs(offset) > kNear) continue;
    near += weight;
    first += weight * offset;
    second += weight * offset * offset;
  }
  const double mean_offset = first / near;
  posterior.mean = posterior.mode + mean_offset;
  posterior.sigma = std::sqrt(std::max(second / near - mean_offset * mean_offset, 0.0) +
                              kCommonSigma * kCommonSigma);
  posterior.probability = same / all;
  return posterior;
}

// Those that agree with a scale.
struct Agreement {
  std::set<int> classes;  // at least half of whose objects do
  int objects = 0;
};

Agreement AgreementWith(double scale, double sigma, const Witnesses& witnesses) {
  Agreement agreement;
  std::map<int, int> balance;
  for (const Witness& witness : witnesses) {
    const double variance = witness.Variance() + sigma * sigma;
    const bool agrees = std::abs(witness.scale - scale) < kAgree * std::sqrt(variance);
    agreement.objects += agrees;
    balance[witness.category_id] += agrees ? 1 : -1;
  }
  for (const auto& [category_id, more] : balance)
    if (more >= 0) agreement.classes.insert(category_id);
  return agreement;
}

// "2 objects of 1 class", "3 objects of 3 classes".
std::string Counted(size_t objects, size_t classes) {
  return fmt::format("{} object{} of {} class{}", objects, objects == 1 ? "" : "s", classes,
                     classes == 1 ? "" : "es");
}

// Why classes that do not agree with the scale are a reason not to believe it; empty where they are
// not: they are few, or agree neither with it nor with each other.
std::string WhyRefuted(const Witnesses& witnesses, const Posterior& posterior,
                       const Agreement& agreement) {
  const Witnesses others = Chosen(witnesses, agreement.classes, false);
  const size_t all = ClassesOf(witnesses).size();
  if (2 * agreement.classes.size() <= all)
    return fmt::format("the objects disagree: only those of {} of {} classes are of usual sizes",
                       agreement.classes.size(), all);
  if (others.empty()) return "";
  const double rival = PosteriorOf(others).mode;
  const size_t rivals = AgreementWith(rival, kCommonSigma, others).classes.size();
  const Witnesses ours = Chosen(witnesses, agreement.classes, true);
  // Classes of which sizes differ much agree with both.
  const size_t decided =
      agreement.classes.size() - AgreementWith(rival, kCommonSigma, ours).classes.size();
  if (rivals < 2 || 2 * decided >= 3 * rivals) return "";
  return fmt::format(
      "the objects disagree: those of {} classes are {:.2f} times as large as those of {} "
      "others, if all are of usual sizes",
      rivals, std::exp(posterior.mode - rival), agreement.classes.size());
}

// How far the floor is below a camera, from the depths of the landmarks below it. A floor is a
// level that many landmarks share, at least as many as are below it: wrong ones and those of
// reflections, which lie scattered. Where no level is like that, the floor is as low as the lowest
// landmarks.
double FloorBelow(std::vector<double> depths) {
  std::ranges::sort(depths, std::greater());
  const auto few = static_cast<size_t>(kOnFloor * static_cast<double>(depths.size()));
  for (size_t lowest = 0; lowest < depths.size() && depths[lowest] > 0; ++lowest) {
    const auto above =
        std::ranges::upper_bound(depths, depths[lowest] * (1 - kThicknessOfFloor), std::greater());
    const auto on_level = static_cast<size_t>(above - depths.begin()) - lowest;
    if (on_level > few && on_level >= lowest) return depths[lowest + on_level / 2];
  }
  return depths[few];
}

// How many of the points are on a level with each point, in the mean.
double MeanOnLevel(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up,
                   double thickness) {
  std::vector<double> heights;
  for (const Eigen::Vector3d& point : points) heights.push_back(point.dot(up));
  std::ranges::sort(heights);
  size_t pairs = 0, top = 0;
  for (size_t i = 0; i < heights.size(); ++i) {
    while (top < heights.size() && heights[top] <= heights[i] + thickness) ++top;
    pairs += top - i;
  }
  return static_cast<double>(pairs) / static_cast<double>(heights.size());
}

// The vertical along which the landmarks lie most in levels: floors and tables. A vertical by how
// the camera was held is not good enough for a floor far away, which a tilt lowers or lifts.
Eigen::Vector3d VerticalByLevels(const Map& map) {
  constexpr size_t kMostPoints = 4000;
  constexpr double kThickness = .04;  // of a level, as a share of the scene's height
  constexpr double kClearer = 1.25;   // than the levels of the map's vertical
  constexpr int kTilts = 6, kDirections = 16;
  if (map.up_keyframes > 0) return *map.up;  // it was measured
  std::vector<Eigen::Vector3d> points;
  std::vector<double> heights;
  const size_t step = 1 + map.landmarks.size() / kMostPoints;
  size_t count = 0;
  map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
    if (count++ % step != 0) return;
    points.push_back(landmark.position);
    heights.push_back(landmark.position.dot(*map.up));
  });
  std::ranges::sort(heights);
  const double thickness =
      kThickness * (heights[heights.size() * 19 / 20] - heights[heights.size() / 20]);
  const Eigen::Vector3d level = map.up->unitOrthogonal(), other = map.up->cross(level);
  Eigen::Vector3d best = *map.up;
  double most = kClearer * MeanOnLevel(points, best, thickness);
  for (int i = 1; i <= kTilts; ++i)
    for (int j = 0; j < kDirections; ++j) {
      const double tilt = kMostTilt * i / kTilts, towards = 2 * std::numbers::pi * j / kDirections;
      const Eigen::Vector3d up =
          std::cos(tilt) * *map.up +
          std::sin(tilt) * (std::cos(towards) * level + std::sin(towards) * other);
      const double on_level = MeanOnLevel(points, up, thickness);
      if (on_level <= most) continue;
      most = on_level;
      best = up;
    }
  return best;
}

// How high above the floor the camera was held, in the median over keyframes; nothing where the map
// does not show. The floor of a keyframe is that of what it and its neighbours see, not of the map:
// a house has several storeys.
std::optional<double> CameraHeight(const Map& map) {
  constexpr int kNeighbours = 10;
  constexpr size_t kMostKeyframes = 200;  // that are looked at: enough for a median
  if (!map.up || map.landmarks.size() < kEnoughLandmarks) return std::nullopt;
  const Eigen::Vector3d up = VerticalByLevels(map);
  std::vector<double> heights;
  const std::vector<KeyframeId> ids = map.keyframes.Ids();
  for (size_t i = 0; i < ids.size(); i += 1 + ids.size() / kMostKeyframes) {
    const double camera = map.keyframes.At(ids[i]).cam_from_world.OriginInSource().dot(up);
    std::vector<double> depths;
    for (const LandmarkId seen : LandmarksSeenBy(map, map.KeyframesAround(ids[i], kNeighbours)))
      depths.push_back(camera - map.landmarks.At(seen).position.dot(up));
    if (depths.size() >= kEnoughLandmarks) heights.push_back(FloorBelow(std::move(depths)));
  }
  if (heights.empty()) return std::nullopt;
  return Median(std::move(heights));
}

// Why a map with this unit is odd; empty where it is not.
std::string WhyOdd(const Map& map, const Posterior& posterior) {
  const std::optional<double> units = CameraHeight(map);
  if (!units) return "";
  const double metres = *units * std::exp(posterior.mean);
  if (metres * std::exp(-posterior.sigma) < kReach_m) return "";
  return fmt::format(
      "the camera would have been {:.1f} m above the floor: models of things, or seen "
      "from where nobody stands",
      metres);
}

std::string WhyNot(const Map& map, const Witnesses& witnesses, const Posterior& posterior,
                   const Agreement& agreement) {
  if (agreement.objects < kLeastObjects || agreement.classes.size() < kLeastClasses)
    return fmt::format("{} agree, it takes {}",
                       Counted(static_cast<size_t>(agreement.objects), agreement.classes.size()),
                       Counted(kLeastObjects, kLeastClasses));
  if (std::string why = WhyRefuted(witnesses, posterior, agreement); !why.empty()) return why;
  if (posterior.probability < kLeastProbability)
    return "the objects disagree: more than one unit explains their sizes";
  return WhyOdd(map, posterior);
}

}  // namespace

ScaleEstimate EstimateScale(const Map& map, const std::map<int, std::string>& names) {
  ScaleEstimate estimate;
  if (!map.up) {
    estimate.why_not = "its vertical is not known";
    return estimate;
  }
  const Witnesses witnesses = WitnessesOf(map, names);
  if (const size_t classes = ClassesOf(witnesses).size();
      witnesses.size() < kLeastObjects || classes < kLeastClasses) {
    estimate.why_not =
        fmt::format("{} have a usual size, it takes {}", Counted(witnesses.size(), classes),
                    Counted(kLeastObjects, kLeastClasses));
    return estimate;
  }
  const Posterior posterior = PosteriorOf(witnesses);
  const Agreement agreement = AgreementWith(posterior.mode, posterior.sigma, witnesses);
  estimate.metres_per_unit = std::exp(posterior.mean);
  estimate.relative_sigma = posterior.sigma;
  estimate.objects = agreement.objects;
  estimate.classes = static_cast<int>(agreement.classes.size());
  estimate.why_not = WhyNot(map, witnesses, posterior, agreement);
  estimate.success = estimate.why_not.empty();
  return estimate;
}

std::string ContradictionOfUnit(const ScaleEstimate& estimate) {
  constexpr double kContradicts = 3;  // sigmas
  if (!estimate.success ||
      std::abs(std::log(estimate.metres_per_unit)) < kContradicts * estimate.relative_sigma)
    return "";
  return fmt::format(
      "by the usual sizes of {} a metre of it is {:.2f} +- {:.2f} m: models of things, or "
      "a wrong length",
      Counted(static_cast<size_t>(estimate.objects), static_cast<size_t>(estimate.classes)),
      estimate.metres_per_unit, estimate.metres_per_unit * estimate.relative_sigma);
}

}  // namespace oaslam
