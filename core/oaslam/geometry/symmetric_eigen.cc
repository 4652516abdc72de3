#include "oaslam/geometry/symmetric_eigen.h"

#include <Eigen/Eigenvalues>

namespace oaslam {

SymmetricEigen2 EigenOfSymmetric(const Eigen::Matrix2d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace oaslam
