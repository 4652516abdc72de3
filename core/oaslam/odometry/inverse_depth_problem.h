#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/odometry/inertial.h"
#include "oaslam/odometry/turn.h"
#include "oaslam/rigid3.h"

namespace oaslam {

class SightingsByPair;

// Bundle adjustment of points that are given by their inverse depth in their anchor, the image that
// saw them first (Civera, Davison and Montiel 2008). A point at infinity has an inverse depth of 0,
// and measures rotations as well as any other point. Directions are rays at z = 1; lengths are in
// the unit of the odometry.

// A sighting of a point in an image other than its anchor. A problem has its measurements sorted by
// point.
struct DepthMeasurement {
  int point = 0, pose = 0;
  Eigen::Vector2d ray;                                             // in the image of `pose`
  Eigen::Matrix2d root_information = Eigen::Matrix2d::Identity();  // symmetric, 1 / rad
  bool is_outlier = false;                                         // has no influence
};

// The anchor of a point, and the prior of its inverse depth.
struct DepthPrior {
  int anchor = 0;       // pose of the image that saw the point first
  Eigen::Vector2d ray;  // in the anchor
  double inverse_depth = 1, sigma = 1;
  bool is_measured = false;  // it may be that of another surface: then its loss is Cauchy's
};

// By how much less than a Gaussian a prior counts for a point of this inverse depth, 0 to 1.
double WeightOf(const DepthPrior& prior, double inverse_depth);

// The prior that the camera keeps its velocity between three images, in the order of their times.
// It is weak, and keeps the position of a camera that only turns from drifting.
struct VelocityPrior {
  int before = 0, middle = 0, after = 0;  // poses
  double first_s = 0, second_s = 0;       // between them
  double sigma = 1;                       // of the change of velocity, per s
};

// The prior that the camera keeps its angular velocity between three images, in the order of their
// times. In front of a plane a rotation looks like a translation, and two motions explain two
// images equally well; in the wrong one the camera mostly turns otherwise than before. The prior is
// robust, with `huber_chi2` of the problem, since a camera may swing round.
struct TurnRatePrior {
  int before = 0, middle = 0, after = 0;  // poses
  double first_s = 0, second_s = 0;       // between them
  double sigma = 1;                       // of the change of the rate about any axis, rad/s
};

// The prior of the distance of two cameras. It fixes the unit of length where no pose is held.
struct LengthPrior {
  int first = 0, second = 0;  // poses
  double length = 1, sigma = 1e-3;
};

// The rotation between two images by a gyroscope.
struct RotationPrior {
  int first = 0, second = 0;  // poses
  Turn turn;
};

// What an IMU tells of the poses. Its unknowns are part of the state.
struct InertialProblem {
  InertialPrior prior;
  Eigen::Vector3d lever = Eigen::Vector3d::Zero();  // the IMU in the camera's frame, metres
  std::vector<InertialTriple> triples{};
};

struct InverseDepthProblem {
  int free_poses = 0;  // the first ones; the others are held
  std::vector<DepthPrior> points;
  std::vector<DepthMeasurement> measurements;
  std::vector<VelocityPrior> velocities;
  std::vector<TurnRatePrior> turn_rates;
  std::vector<RotationPrior> rotations;
  std::optional<LengthPrior> length;
  std::optional<InertialProblem> inertial;
  double corner_chi2 = 0;          // of the measurements' pseudo-Huber loss
  double huber_chi2 = 0;           // of the turn rates, and where solutions are compared
  double least_inverse_depth = 0;  // of a point; slightly below 0 (infinity) because of noise
};

struct InverseDepthState {
  std::vector<Rigid3> poses;  // cam_from_odom
  std::vector<double> inverse_depths;
  InertialVector inertial = InertialVector::Zero();  // only where the problem has such a part
};

// A point has no projection in an image in which its depth is less than this share of its depth in
// the anchor. A real point seldom comes nearer than some tenths of that depth.
inline constexpr double kNearest = 0.02;

// A point in the frame of another image, times its inverse depth.
inline Eigen::Vector3d ScaledPoint(const Rigid3& to_from_anchor, const Eigen::Vector2d& ray,
                                   double inverse_depth) {
  return to_from_anchor.rotation * ray.homogeneous() + inverse_depth * to_from_anchor.translation;
}

// The robust cost: the sum of the losses of squared errors, in sigmas. Outliers do not count. With
// `outlier_chi2` all measurements count by Huber's loss, each at most as much as one with this
// squared error, so that the costs of solutions with different outliers can be compared.
double CostOf(const InverseDepthProblem& problem, const InverseDepthState& state,
              std::optional<double> outlier_chi2 = std::nullopt);
// The same with memory that is kept between calls: `sightings` of the problem, which are updated,
// and the cost of each.
double CostOf(const InverseDepthProblem& problem, const InverseDepthState& state,
              std::optional<double> outlier_chi2, SightingsByPair& sightings,
              std::vector<double>& costs);

// The problem without the priors of motions and depths: the images alone count.
InverseDepthProblem WithoutPriors(InverseDepthProblem problem);

inline constexpr double kMostSigmas = 4;  // a measurement that is off by more is an outlier
// How well the images agree with a state, outliers included: the mean cost of a measurement
// (CostOf) in a problem without priors, with kMostSigmas as the largest error that counts.
double CostOfImages(const InverseDepthProblem& bare, const InverseDepthState& state);

// Sets the inverse depth of each point to the one of `candidates` that its measurements fit best,
// outliers included.
void SearchDepths(std::span<const double> candidates, const InverseDepthProblem& problem,
                  InverseDepthState& state);
// SearchDepths over candidates from 0 (infinity) to 14 times `usual`.
void SearchDepths(double usual, const InverseDepthProblem& problem, InverseDepthState& state);

}  // namespace oaslam
