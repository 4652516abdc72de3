#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"
#include "oaslam/util/rng.h"

namespace oaslam {

struct TwoViewOptions {
  int essential_iterations = 300;   // RANSAC, samples of 8
  int homography_iterations = 150;  // RANSAC, samples of 4
  int min_points = 50;              // triangulated
  double min_inlier_share = 0.5;    // of the matches
  double max_rival =
      0.5;  // refused when another motion explains more than this share of what the best one does
  double min_parallax_deg = 1;         // of at least `min_points` points
  double max_direction_sigma_deg = 2;  // standard deviation of the direction of translation: more,
                                       // and rotation passes for translation
};

struct TwoViewReport {
  bool success = false;
  std::string why_not;
  Rigid3 second_from_first;  // translation of length 1
  // In the first camera, per match; nothing where the match is no inlier or its rays are nearly
  // parallel.
  std::vector<std::optional<Eigen::Vector3d>> points;
  int inliers = 0;  // of the epipolar geometry
  int triangulated = 0;
  double parallax_deg = 0;         // that `min_points` of the triangulated points reach
  double direction_sigma_deg = 0;  // of the translation, largest direction
  double rival = 0;     // share of what the motion explains that another one explains, too
  bool planar = false;  // the homography scored as well as the essential matrix
};

// Relative motion and points of two views from matches in their ideal images. A homography and an
// essential matrix compete in RANSAC (scores of Mur-Artal et al. 2015, IV); the motions of both
// that have points in front are refined on all matches and compared by what they triangulate.
// `sigma_px`: of each match, in either image. Prefers refusing to a wrong motion: pure rotation,
// low parallax, two motions that explain about the same.
TwoViewReport EstimateTwoView(const Camera& camera_first, const Camera& camera_second,
                              std::span<const Eigen::Vector2d> px_first,
                              std::span<const Eigen::Vector2d> px_second,
                              std::span<const double> sigma_px, const TwoViewOptions& options,
                              Rng& rng);

}  // namespace oaslam
