#pragma once

#include <Eigen/Geometry>

#include "oaslam/rigid3.h"

namespace oaslam {

// x_in_b = scale * (rotation * x_in_a) + translation; products are as for Rigid3.
struct Similarity {
  double scale = 1;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Similarity() = default;
  Similarity(double s, const Eigen::Quaterniond& r, const Eigen::Vector3d& t)
      : scale(s), rotation(r), translation(t) {}
  explicit Similarity(const Rigid3& rigid)
      : rotation(rigid.rotation), translation(rigid.translation) {}

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const {
    return scale * (rotation * x) + translation;
  }
  Similarity operator*(const Similarity& other) const {
    return {scale * other.scale, (rotation * other.rotation).normalized(),
            *this * other.translation};
  }
  Similarity Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {1 / scale, inverse, inverse * -translation / scale};
  }
  // The rigid pose that sees the same image, with depths divided by the scale.
  Rigid3 AsPose() const { return {rotation, translation / scale}; }
};

}  // namespace oaslam
