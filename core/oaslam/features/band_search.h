#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace oaslam {

// Image points, each with the largest distance at which it still counts as on a line; a structure
// of arrays.
struct BandPoints {
  std::vector<float> x, y, tolerance;

  void Add(const Eigen::Vector2f& point, float tolerance_px);
  int size() const { return static_cast<int>(x.size()); }
};

// Ascending indices of the points p with |a x + b y + c| <= tolerance; `line` = (a, b, c) with a^2
// + b^2 = 1. `found`: a buffer that holds the result.
std::span<const int32_t> PointsNearLine(const BandPoints& points, const Eigen::Vector3f& line,
                                        std::vector<int32_t>& found);

}  // namespace oaslam
