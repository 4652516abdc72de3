#pragma once

#include <Eigen/Core>
#include <vector>

#include "oaslam/rigid3.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Matches as rays (z = 1) of the two cameras; residuals are converted to pixels
// by the focal lengths.
struct RayMatches {
  std::vector<Eigen::Vector3d> first, second;
  std::vector<double> sigma;  // px, of each match, in either image
  double focal_first = 1, focal_second = 1;
  int size() const { return static_cast<int>(first.size()); }
};

// A 3x3 model between the rays of two cameras, and its score: the sum over both images of
// max(0, 5.991 - chi^2), or zero where chi^2 exceeds the bound of the model (Mur-Artal et al. 2015,
// eq. 2).
struct TwoViewModel {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  double score = 0;
};

// x_second ~ H x_first.
TwoViewModel FitHomography(const RayMatches& matches, int iterations, Rng& rng);
// x_second^T E x_first = 0.
TwoViewModel FitEssential(const RayMatches& matches, int iterations, Rng& rng);

// The candidate motions second_from_first, translations of length 1. A homography that is a pure
// rotation gives none.
std::vector<Rigid3> MotionsOfEssential(const Eigen::Matrix3d& essential);
std::vector<Rigid3> MotionsOfHomography(const Eigen::Matrix3d& homography,
                                        const RayMatches& matches);

}  // namespace oaslam
