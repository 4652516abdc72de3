#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"

namespace oaslam {

struct TwoViewOptions {
  int min_points = 50;            // triangulated: fewer are soon out of view, and tracking is lost
  double min_inlier_share = 0.5;  // of the matches
  double min_parallax_deg = 1;    // of at least `min_points` points
  // Largest standard deviation of the direction of translation; with more, a rotation may be
  // mistaken for a translation.
  double max_direction_sigma_deg = 2;
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
};

// Triangulates the points that two views see from matches in their ideal images. First refines the
// motion between the views, `second_from_first` (of any length), on the matches. `sigma_px`: of
// each match, in either image. Fails rather than returns doubtful points: at low parallax, or with
// matches that do not agree with the motion.
TwoViewReport TriangulateTwoViews(const Camera& camera_first, const Camera& camera_second,
                                  std::span<const Eigen::Vector2d> px_first,
                                  std::span<const Eigen::Vector2d> px_second,
                                  std::span<const double> sigma_px, const Rigid3& second_from_first,
                                  const TwoViewOptions& options);

}  // namespace oaslam
