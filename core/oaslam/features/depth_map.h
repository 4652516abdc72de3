#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace oaslam {

// A measured depth: z in the camera's frame.
struct MeasuredDepth {
  double z = 0, sigma = 0;  // metres
};

// The depths that a depth camera measured, as the image of the camera shows them (DepthImage);
// immutable.
class DepthMap {
 public:
  // `z`: row by row, in metres; 0 where nothing was measured. `floor` and `quadratic` as in
  // DepthModel. The pixels of the image of `image_width` x `image_height` are divided into
  // `width` x `height`.
  DepthMap(int width, int height, std::vector<float> z, int image_width, int image_height,
           double floor, double quadratic);

  // Of what a pixel of the image shows (not the ideal one: as the lens distorts it); nothing where
  // it was not measured, and at the edge of something nearer, where the pixel may show either.
  std::optional<MeasuredDepth> At(const Eigen::Vector2d& px) const;
  int width() const { return width_; }
  int height() const { return height_; }
  // Of a pixel of the map; 0 where nothing was measured.
  float z(int x, int y) const { return z_[static_cast<size_t>(y) * width_ + x]; }
  // The pixel of the map that has a pixel of the image.
  Eigen::Vector2d InMap(const Eigen::Vector2d& px) const;

 private:
  int width_, height_;
  std::vector<float> z_;
  double x_scale_, y_scale_;
  double floor_, quadratic_;
};

}  // namespace oaslam
