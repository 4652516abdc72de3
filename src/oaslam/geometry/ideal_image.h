#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/camera.h"
#include "oaslam/types.h"

namespace oaslam {

// What a camera shows of its ideal image, in which a lens with distortion sees no rectangle. Points
// beyond the angle up to which the lens model is one to one (MaxLensAngle) are none of it: some
// pixels have no ideal point, and points outside of the view may seem to be inside.
class IdealImage {
 public:
  explicit IdealImage(const Camera& camera);

  // The ideal point of a pixel; nothing where the model has none.
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& pixel) const;

  // Whether this point of the ideal image is in the original one.
  bool Shows(const Eigen::Vector2d& ideal) const;

  // The share of a box of the ideal image that is in the original one; 0 of an empty box.
  double ShareShown(const Box& box) const;

  // The box around all that is shown.
  const Box& bounds() const { return bounds_; }

 private:
  bool IsWithinModel(const Eigen::Vector2d& ideal) const;

  Camera camera_;
  double max_angle_ = 0, max_radius_ = 0;  // rad; in the plane z = 1
  Box bounds_;
};

}  // namespace oaslam
