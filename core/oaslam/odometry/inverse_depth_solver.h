#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/estimation/schur_options.h"
#include "oaslam/odometry/turn.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// Points by their inverse depth in the image that saw them first (Civera, Davison and Montiel
// 2008): one at infinity, with an inverse depth of 0, is as good a measurement of rotations as any.
// Directions are rays at z = 1; lengths are in the unit of the odometry.

// A point seen again. Sorted by point; a point is not measured in its anchor.
struct DepthMeasurement {
  int point = 0, pose = 0;
  Eigen::Vector2d ray;                                             // in the image of `pose`
  Eigen::Matrix2d root_information = Eigen::Matrix2d::Identity();  // symmetric, 1 / rad
  bool is_outlier = false;                                         // has no influence
};

// What is known of a point before its measurements.
struct DepthPrior {
  int anchor = 0;       // pose of the image that saw it first
  Eigen::Vector2d ray;  // there
  double inverse_depth = 1, sigma = 1;
};

// The camera keeps its velocity between three images, in the order of their times: a weak prior,
// so that a camera that turns only does not wander.
struct VelocityPrior {
  int before = 0, middle = 0, after = 0;  // poses
  double first_s = 0, second_s = 0;       // between them
  double sigma = 1;                       // of the change of velocity, per s
};

// The camera keeps turning as it did between three images, in the order of their times. Beside a
// plane a turn looks like a way, and two motions explain two images alike: the wrong one mostly
// turns otherwise than before. Robust, by the threshold of the problem: a camera may swing round.
struct TurnRatePrior {
  int before = 0, middle = 0, after = 0;  // poses
  double first_s = 0, second_s = 0;       // between them
  double sigma = 1;                       // of the change of the rate about any axis, rad/s
};

// The distance of two cameras: the unit of length, where no pose is held.
struct LengthPrior {
  int first = 0, second = 0;  // poses
  double length = 1, sigma = 1e-3;
};

// What a gyroscope tells of two images.
struct RotationPrior {
  int first = 0, second = 0;  // poses
  Turn turn;
};

struct InverseDepthProblem {
  int free_poses = 0;  // the first ones; the others are held
  std::vector<DepthPrior> points;
  std::vector<DepthMeasurement> measurements;
  std::vector<VelocityPrior> velocities;
  std::vector<TurnRatePrior> turn_rates;
  std::vector<RotationPrior> rotations;
  std::optional<LengthPrior> length;
  double corner_chi2 = 0;          // of the measurements' PseudoHuberLossOf
  double huber_chi2 = 0;           // of the turn rates, and where solutions are compared
  double least_inverse_depth = 0;  // of a point; below 0 by what noise may do, since 0 is infinity
};

struct InverseDepthState {
  std::vector<Rigid3> poses;  // cam_from_odom
  std::vector<double> inverse_depths;
};

// A point whose depth, times its inverse depth in the anchor, is less than this has no image: the
// nearest things are some tenths of the depth in the anchor away.
inline constexpr double kNearest = 0.02;

// A point in the frame of another image, times its inverse depth.
inline Eigen::Vector3d ScaledPoint(const Rigid3& to_from_anchor, const Eigen::Vector2d& ray,
                                   double inverse_depth) {
  return to_from_anchor.rotation * ray.homogeneous() + inverse_depth * to_from_anchor.translation;
}

// The sum of the squared errors over their sigmas, robust. Measurements that are outliers count
// nothing. With `outlier_chi2` all measurements count by Huber's loss, each at most as much as one
// with this squared error: so the costs of different solutions can be compared, whatever they hold
// to be outliers.
double CostOf(const InverseDepthProblem& problem, const InverseDepthState& state,
              std::optional<double> outlier_chi2 = std::nullopt);

// The problem of the images alone: what was believed of motions and depths counts for nothing.
InverseDepthProblem WithoutPriors(InverseDepthProblem problem);

inline constexpr double kMostSigmas = 4;  // a measurement that is off by more is an outlier
// How well the images agree with a state, outliers included: CostOf a measurement of a problem
// without priors, in which an outlier counts as much as one that hardly fits.
double CostOfImages(const InverseDepthProblem& bare, const InverseDepthState& state);

// Sets the inverse depth of each point to the one of `candidates` that its measurements fit best,
// outliers included.
void SearchDepths(std::span<const double> candidates, const InverseDepthProblem& problem,
                  InverseDepthState& state);
// From infinity to 14 times `usual`.
void SearchDepths(double usual, const InverseDepthProblem& problem, InverseDepthState& state);

// How the scale of what the last free pose sees depends on the poses: the mean logarithm of the
// inverse depths of its points, by how well they are known.
struct ScaleInView {
  Eigen::VectorXd by_poses;  // its derivative by the free poses, in the order of PoseVector
  double variance = 0;       // that of the depths themselves, the poses being right; 1 without any
};

struct InverseDepthReport {
  MinimizationReport solver;
  std::vector<double> variances;  // of each inverse depth, the poses being right
  // Of the free poses, the points eliminated: the normal equations at the last linearisation, in
  // the order of PoseVector. Empty unless it was asked for.
  Eigen::MatrixXd information;
  ScaleInView scale;  // with it
};

// Levenberg-Marquardt on the Schur complement of the inverse depths. Huber's threshold is that of
// the problem. The memory that it needs is used again by the next call.
class InverseDepthSolver {
 public:
  InverseDepthSolver();
  ~InverseDepthSolver();
  InverseDepthReport Minimize(const InverseDepthProblem& problem, const SchurOptions& options,
                              InverseDepthState& state, bool with_information = false);

  struct Memory;

 private:
  std::unique_ptr<Memory> memory_;
};

}  // namespace oaslam
