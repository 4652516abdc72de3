#pragma once

#include <Eigen/Core>
#include <optional>

namespace oaslam {

// Eigen's solvers for small matrices. They are compiled once here, since each adds seconds to the
// compilation of a file that instantiates it.

// The eigenvalues of a symmetric matrix, ascending, and the eigenvectors as columns in this order.
template <int N>
struct SymmetricEigen {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};
SymmetricEigen<2> EigenOfSymmetric(const Eigen::Matrix2d& matrix);
SymmetricEigen<3> EigenOfSymmetric(const Eigen::Matrix3d& matrix);

// matrix = u * diag(values) * v^T; the values descend.
struct SingularValues {
  Eigen::Matrix3d u;
  Eigen::Vector3d values;
  Eigen::Matrix3d v;
};
SingularValues SingularValuesOf(const Eigen::Matrix3d& matrix);

// Solves matrix * x = right for a symmetric matrix; N is 5, 6 or 7.
template <int N>
Eigen::Matrix<double, N, 1> SolveSymmetric(const Eigen::Matrix<double, N, N>& matrix,
                                           const Eigen::Matrix<double, N, 1>& right);

// The inverse of a symmetric matrix of information; nothing where it does not determine all
// parameters. N is 6 or 7.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> InverseOfInformation(
    const Eigen::Matrix<double, N, N>& information);

}  // namespace oaslam
