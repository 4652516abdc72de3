#pragma once

#include <Eigen/Core>

namespace oaslam {

// The eigenvalues of a symmetric matrix, ascending, and the eigenvectors as columns in this order.
struct SymmetricEigen2 {
  Eigen::Vector2d values;
  Eigen::Matrix2d vectors;
};
// This function has a source file of its own, since Eigen's solver adds four seconds to the
// compilation of each file that includes it.
SymmetricEigen2 EigenOfSymmetric(const Eigen::Matrix2d& matrix);

}  // namespace oaslam
