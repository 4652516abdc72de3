#include "oaslam/geometry/ideal_image.h"

#include <cmath>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

bool IsExact(const Camera& camera) {
  return camera.model == LensModel::kPinhole && !camera.HasDistortion();
}

}  // namespace

IdealImage::IdealImage(const Camera& camera)
    : camera_(camera),
      max_angle_(MaxLensAngle(camera)),
      max_radius_(std::tan(max_angle_)),
      bounds_(IdealImageBounds(camera)) {}

bool IdealImage::IsWithinModel(const Eigen::Vector2d& ideal) const {
  return RayOf(camera_, ideal).head<2>().norm() < max_radius_ * (1 - 1e-9);
}

std::optional<Eigen::Vector2d> IdealImage::Undistort(const Eigen::Vector2d& pixel) const {
  if (IsExact(camera_)) return pixel;
  constexpr double kConvergedPx = 1e-3;  // where the inverse was found at all it is far better
  const Eigen::Vector2d ideal = oaslam::Undistort(camera_, max_angle_, pixel);
  const bool is_found = IsWithinModel(ideal) && (Distort(camera_, ideal) - pixel).squaredNorm() <
                                                    kConvergedPx * kConvergedPx;
  return is_found ? std::optional(ideal) : std::nullopt;
}

bool IdealImage::Shows(const Eigen::Vector2d& ideal) const {
  if (!IsWithinModel(ideal)) return false;
  const Eigen::Vector2d pixel = Distort(camera_, ideal);
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= camera_.width - 0.5 &&
         pixel.y() <= camera_.height - 0.5;
}

double IdealImage::ShareShown(const Box& box) const {
  if (IsExact(camera_)) return ShareInside(box, bounds_);
  if (!(box.Area() > 0)) return 0;
  constexpr int kSteps = 8;  // 64 points: the share is compared with thresholds in tenths
  int shown = 0;
  for (int row = 0; row < kSteps; ++row)
    for (int column = 0; column < kSteps; ++column)
      shown += Shows({box.x1 + (column + 0.5) / kSteps * box.Width() - kBoxFromPixel,
                      box.y1 + (row + 0.5) / kSteps * box.Height() - kBoxFromPixel});
  return static_cast<double>(shown) / (kSteps * kSteps);
}

}  // namespace oaslam
