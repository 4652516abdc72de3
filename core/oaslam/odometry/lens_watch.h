#pragma once

#include <Eigen/Core>
#include <deque>
#include <span>
#include <utility>

#include "oaslam/odometry/pose_starts.h"

namespace oaslam {

// By how much the focal length of an image differs from that with which its points were measured:
// the logarithm of the ratio.
struct FocalChange {
  Eigen::Vector2d by_axis = Eigen::Vector2d::Zero();  // along the width and the height
  Eigen::Vector2d sigma_by_axis = Eigen::Vector2d::Ones();
  double both = 0, sigma = 1;  // as one number

  // The least change, with its sign, that each of the axes shows by three standard deviations; 0
  // where one of them shows none. A rolling shutter and a wrong depth stretch one of them only.
  double Sure() const;
};

// Estimates pose and focal lengths of an image from its points; `start`: by RefinePose from the
// same points. The unknowns of a camera whose lens changes, as in P3P with unknown focal length,
// where the points have known depths.
FocalChange FocalChangeOf(std::span<const PosePoint> points, const WindowOptions& options,
                          const PoseFitPrior& prior, const Rigid3& start);

// Follows the focal length of a lens that zooms or focuses, from image to image. A lens that does
// not change is never followed: the ratio stays exactly the same.
class LensWatch {
 public:
  // Takes what an image tells. Returns whether the lens is followed; then the ratio is the image's.
  bool Add(const FocalChange& change, double time_s);
  // The lens was replaced by another one: the focal length is `ratio` times the camera's.
  void Replace(double ratio);

  // The focal length of the newest image, divided by the camera's.
  double ratio() const;
  bool is_followed() const { return is_followed_; }

 private:
  bool Begins(double sure);
  bool IsAtRest(double time_s) const;

  double log_ratio_ = 0, variance_ = 0;
  bool is_followed_ = false;
  // How many images in a row have shown a change of one sign, large or small.
  int large_ = 0, small_ = 0;
  double last_sure_ = 0;
  double last_s_ = 0;
  std::deque<std::pair<double, double>> ratios_;  // time, log_ratio_; of the last second or two
};

}  // namespace oaslam
