#include "oaslam/features/depth_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/util/check.h"

namespace oaslam {

DepthMap::DepthMap(int width, int height, std::vector<float> z, int image_width, int image_height,
                   double floor, double quadratic)
    : width_(width),
      height_(height),
      z_(std::move(z)),
      x_scale_(static_cast<double>(width) / image_width),
      y_scale_(static_cast<double>(height) / image_height),
      floor_(floor),
      quadratic_(quadratic) {
  OASLAM_CHECK(z_.size() == static_cast<size_t>(width) * height);
}

Eigen::Vector2d DepthMap::InMap(const Eigen::Vector2d& px) const {
  return {(px.x() + 0.5) * x_scale_ - 0.5, (px.y() + 0.5) * y_scale_ - 0.5};
}

std::optional<MeasuredDepth> DepthMap::At(const Eigen::Vector2d& px) const {
  // Depths that differ by more than this share are of two surfaces: no wall that a corner is found
  // on leans so much over three pixels.
  constexpr float kEdge = 0.04F;
  const Eigen::Vector2d at = InMap(px);
  const auto x = static_cast<int>(std::lround(at.x())), y = static_cast<int>(std::lround(at.y()));
  if (x < 1 || y < 1 || x + 1 >= width_ || y + 1 >= height_) return std::nullopt;
  constexpr int kLeast = 6;  // of the nine around it
  int count = 0;
  float least = INFINITY, most = 0, sum = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const float depth = z(x + dx, y + dy);
      if (depth <= 0) continue;
      ++count;
      sum += depth;
      least = std::min(least, depth);
      most = std::max(most, depth);
    }
  if (z(x, y) <= 0 || count < kLeast || most > (1 + kEdge) * least) return std::nullopt;
  const double mean = sum / static_cast<float>(count);
  return MeasuredDepth{mean, floor_ + quadratic_ * mean * mean};
}

}  // namespace oaslam
