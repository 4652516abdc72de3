#include "oaslam/formats/rotated_box.h"

#include <Eigen/Geometry>
#include <numbers>
#include <vector>

namespace oaslam {

Box HullOf(std::span<const Eigen::Vector2d> points) {
  Eigen::AlignedBox2d hull(points.front());
  for (const Eigen::Vector2d& point : points) hull.extend(point);
  return {hull.min().x(), hull.min().y(), hull.max().x(), hull.max().y()};
}

Box RotatedHull(const Box& box, double degrees, const Eigen::Vector2d& about) {
  if (degrees == 0) return box;
  const Eigen::Rotation2Dd rotation(degrees * std::numbers::pi / 180);  // y points down
  std::vector<Eigen::Vector2d> corners;
  for (const double x : {box.x1, box.x2})
    for (const double y : {box.y1, box.y2})
      corners.push_back(about + rotation * (Eigen::Vector2d(x, y) - about));
  return HullOf(corners);
}

}  // namespace oaslam
