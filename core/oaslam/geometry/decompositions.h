#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace oaslam {

// Eigen's solvers for small matrices. They are compiled once, since each adds seconds to the
// compilation of a file that instantiates it; in two files, since GCC takes far longer for all of
// them in one. Those for symmetric matrices are in decompositions_symmetric.cc.

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

// The smallest rotation that turns the direction `from` into the direction `to`.
Eigen::Quaterniond TurnBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

// N is 6, 7 or 8.
template <int N>
Eigen::Matrix<double, N, N> InverseOf(const Eigen::Matrix<double, N, N>& matrix);

// Solves matrix * x = right for a symmetric matrix; N is 5, 6, 7 or 8.
template <int N>
Eigen::Matrix<double, N, 1> SolveSymmetric(const Eigen::Matrix<double, N, N>& matrix,
                                           const Eigen::Matrix<double, N, 1>& right);

// N is 5 or 6.
template <int N>
Eigen::Matrix<double, N, N> InverseOfSymmetric(const Eigen::Matrix<double, N, N>& matrix);

// Solves matrix * x = right for a symmetric matrix, and inverts the matrix. Nothing where the
// matrix is not positive semidefinite. N is 7.
template <int N>
struct SolutionAndInverse {
  Eigen::Matrix<double, N, 1> solution;
  Eigen::Matrix<double, N, N> inverse;
};
template <int N>
std::optional<SolutionAndInverse<N>> SolveAndInvertSemidefinite(
    const Eigen::Matrix<double, N, N>& matrix, const Eigen::Matrix<double, N, 1>& right);

// Replaces a symmetric, positive definite matrix by l of its Cholesky decomposition l * l^T. Only
// the lower half is read and written. Returns false where the matrix is not positive definite.
bool FactorisePositive(Eigen::Ref<Eigen::MatrixXd> matrix);
// Solves matrix * x = right; the matrix is replaced as by FactorisePositive. Nothing where the
// matrix is not positive definite.
std::optional<Eigen::VectorXd> SolvePositive(Eigen::Ref<Eigen::MatrixXd> matrix,
                                             const Eigen::VectorXd& right);

// The inverse of a symmetric matrix of information; nothing where it does not determine all
// parameters. N is 6 or 7.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> InverseOfInformation(
    const Eigen::Matrix<double, N, N>& information);

}  // namespace oaslam
