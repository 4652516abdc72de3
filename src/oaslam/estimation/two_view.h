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
  // Samples of 8 and of 4. They find a model in 95 % of cases where 56 % and 38 % are inliers.
  int essential_iterations = 300, homography_iterations = 150;
  int min_points = 50;            // triangulated: fewer are soon out of view, and tracking is lost
  double min_inlier_share = 0.5;  // of the matches
  // The result is rejected when another motion explains more than this share of what
  // the best one explains.
  double max_rival = 0.5;
  double min_parallax_deg = 1;  // of at least `min_points` points
  // Largest standard deviation of the direction of translation; with more, a rotation may be
  // mistaken for a translation.
  double max_direction_sigma_deg = 2;
  // second_from_first, of any length, where it is known: it is refined, and no other is looked for.
  std::optional<Rigid3> known_motion{};
};

struct TwoViewReport {
  bool success = false;
  std::string why_not;
  Rigid3 second_from_first;  // translation of length 1
  // By match, in the first camera's frame; nothing where the match is no inlier or its rays are
  // nearly parallel.
  std::vector<std::optional<Eigen::Vector3d>> points;
  int inliers = 0;  // of the epipolar geometry
  int triangulated = 0;
  double parallax_deg = 0;         // reached by `min_points` of the triangulated points
  double direction_sigma_deg = 0;  // of the translation, in its least certain direction
  // How much another motion explains, as a share of what this one explains.
  double rival = 0;
  bool planar = false;  // the homography scores about as high as the essential matrix
};

// Estimates the relative motion of two views and the points they see, from matches in their ideal
// images. A homography and an essential matrix are estimated by RANSAC (scores of Mur-Artal et al.
// 2015, IV); the motions of both with points in front of the cameras are refined on all matches and
// compared by what they triangulate. `sigma_px`: of each match, in either image. Rejects rather
// than returns a doubtful motion: pure rotation, low parallax, or two motions that explain about
// the same.
TwoViewReport EstimateTwoView(const Camera& camera_first, const Camera& camera_second,
                              std::span<const Eigen::Vector2d> px_first,
                              std::span<const Eigen::Vector2d> px_second,
                              std::span<const double> sigma_px, const TwoViewOptions& options,
                              Rng& rng);

}  // namespace oaslam
