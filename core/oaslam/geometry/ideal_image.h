#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/camera.h"
#include "oaslam/types.h"

namespace oaslam {

// The part of the ideal image that a camera shows; with distortion it is no rectangle. It ends at
// the angle up to which the lens model is one to one (MaxLensAngle): beyond it some pixels have no
// ideal point, and the model maps points outside of the view into the image.
class IdealImage {
 public:
  explicit IdealImage(const Camera& camera);

  // The ideal point of a pixel; nothing where the model has none.
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& pixel) const;

  // Whether this point of the ideal image is in the original one.
  bool Shows(const Eigen::Vector2d& ideal) const;

  // The share of a box of the ideal image that is in the original one; 0 for an empty box.
  double ShareShown(const Box& box) const;

  // The bounding box of the part of the ideal image that the camera shows.
  const Box& bounds() const { return bounds_; }

 private:
  bool IsWithinModel(const Eigen::Vector2d& ideal) const;

  Camera camera_;
  double max_angle_ = 0, max_radius_ = 0;  // rad; in the plane z = 1
  Box bounds_;
};

}  // namespace oaslam
