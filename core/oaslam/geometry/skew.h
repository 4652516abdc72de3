#pragma once

#include <Eigen/Core>

namespace oaslam {

// The matrix of the cross product: Skew(v) * u is v cross u.
inline Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace oaslam
