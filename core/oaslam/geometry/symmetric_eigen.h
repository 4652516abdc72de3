#pragma once

#include <Eigen/Core>

namespace oaslam {

// The eigenvalues of a symmetric matrix, ascending, and the eigenvectors as columns in this order.
struct SymmetricEigen2 {
  Eigen::Vector2d values;
  Eigen::Matrix2d vectors;
};
// Its own file compiles Eigen's solver, which takes four seconds in each that does.
SymmetricEigen2 EigenOfSymmetric(const Eigen::Matrix2d& matrix);

}  // namespace oaslam
