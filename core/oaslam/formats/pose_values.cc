#include "oaslam/formats/pose_values.h"

#include <Eigen/LU>
#include <cmath>

#include "oaslam/util/bad_input.h"

namespace oaslam {

std::optional<Rigid3> PoseOfRows(std::span<const double> rows, double rounded) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(rows.data());
  const Eigen::Matrix3d rotation = m.leftCols<3>();
  if (!(rotation * rotation.transpose()).isIdentity(rounded) || rotation.determinant() < 0)
    return std::nullopt;
  return Rigid3(Eigen::Quaterniond(rotation).normalized(), m.col(3));
}

Rigid3 PoseOfQuaternion(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation,
                        const std::string& place) {
  if (std::abs(rotation.norm() - 1) > 0.1)
    throw BadInput("{}: quaternion of length {:.3g}, expected 1", place, rotation.norm());
  return {rotation.normalized(), translation};
}

}  // namespace oaslam
