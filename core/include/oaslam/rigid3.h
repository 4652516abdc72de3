#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace oaslam {

// A rigid motion x_in_b = b_from_a * x_in_a. Named after its direction, so that a wrong product is
// visible:
//
//   const Rigid3 c_from_a = c_from_b * b_from_a;
//   const Eigen::Vector3d in_c = c_from_a * in_a;
//   const Rigid3 a_from_c = c_from_a.Inverse();
struct Rigid3 {
  // A rotation as a unit quaternion. Unaligned: the alignment of Eigen::Quaterniond depends on the
  // instruction set that a program is compiled for, so that the library and a program could
  // disagree on the layout of a struct.
  using Rotation = Eigen::Quaternion<double, Eigen::DontAlign>;

  Rotation rotation = Rotation::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3() = default;
  // First rotates, then translates.
  Rigid3(const Rotation& r, const Eigen::Vector3d& t) : rotation(r), translation(t) {}
  // The same with a rotation matrix.
  Rigid3(const Eigen::Matrix3d& r, const Eigen::Vector3d& t) : rotation(r), translation(t) {}

  // b_from_a * x_in_a.
  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }

  // c_from_b * b_from_a.
  Rigid3 operator*(const Rigid3& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }

  // a_from_b.
  Rigid3 Inverse() const {
    const Rotation inverse = rotation.conjugate();
    return {inverse, inverse * -translation};
  }

  // Of cam_from_world: the camera centre in the world.
  Eigen::Vector3d OriginInSource() const { return rotation.conjugate() * -translation; }

  // Whether this is a rigid motion: its numbers are finite, and its quaternion has length 1 up to
  // rounding.
  bool IsValid() const { return translation.allFinite() && IsUnit(rotation); }
  // Whether a quaternion has length 1 up to rounding; false also where it is not finite.
  static bool IsUnit(const Rotation& rotation) {
    // Errors of files with few digits are smaller, those of a wrong quaternion far larger.
    constexpr double kRounding = 1e-3;
    return std::abs(rotation.norm() - 1) <= kRounding;
  }

  // [R | t].
  Eigen::Matrix<double, 3, 4> Matrix() const {
    Eigen::Matrix<double, 3, 4> m;
    m << rotation.toRotationMatrix(), translation;
    return m;
  }
};

// The covariance of a camera's pose: of a small motion (translation in map units, rotation vector
// in rad; axes of the camera) between the pose and the true one.
using PoseCovariance = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

// The covariance after all lengths were multiplied by `factor`.
inline PoseCovariance WithScaledLengths(PoseCovariance covariance, double factor) {
  covariance.topRows<3>() *= factor;
  covariance.leftCols<3>() *= factor;
  return covariance;
}
// Root mean square of the distance between the positions, map units.
inline double SigmaOfPosition(const PoseCovariance& covariance) {
  return std::sqrt(std::max(covariance.topLeftCorner<3, 3>().trace(), 0.0));
}
// Root mean square of the angle between the rotations, rad.
inline double SigmaOfRotation(const PoseCovariance& covariance) {
  return std::sqrt(std::max(covariance.bottomRightCorner<3, 3>().trace(), 0.0));
}

}  // namespace oaslam
