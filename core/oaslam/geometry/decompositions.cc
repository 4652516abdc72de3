#include "oaslam/geometry/decompositions.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace oaslam {

SymmetricEigen<2> EigenOfSymmetric(const Eigen::Matrix2d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigen<3> EigenOfSymmetric(const Eigen::Matrix3d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SingularValues SingularValuesOf(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

template <int N>
Eigen::Matrix<double, N, 1> SolveSymmetric(const Eigen::Matrix<double, N, N>& matrix,
                                           const Eigen::Matrix<double, N, 1>& right) {
  return matrix.ldlt().solve(right);
}

template <int N>
std::optional<Eigen::Matrix<double, N, N>> InverseOfInformation(
    const Eigen::Matrix<double, N, N>& information) {
  constexpr double kLeastPivot = 1e-12;  // relative to the largest: above the errors of rounding
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> factor(information);
  if (factor.info() != Eigen::Success ||
      !(factor.vectorD().minCoeff() > kLeastPivot * factor.vectorD().maxCoeff()))
    return std::nullopt;
  return factor.solve(Eigen::Matrix<double, N, N>::Identity());
}

template Eigen::Matrix<double, 5, 1> SolveSymmetric<5>(const Eigen::Matrix<double, 5, 5>&,
                                                       const Eigen::Matrix<double, 5, 1>&);
template Eigen::Matrix<double, 6, 1> SolveSymmetric<6>(const Eigen::Matrix<double, 6, 6>&,
                                                       const Eigen::Matrix<double, 6, 1>&);
template Eigen::Matrix<double, 7, 1> SolveSymmetric<7>(const Eigen::Matrix<double, 7, 7>&,
                                                       const Eigen::Matrix<double, 7, 1>&);
template std::optional<Eigen::Matrix<double, 6, 6>> InverseOfInformation<6>(
    const Eigen::Matrix<double, 6, 6>&);
template std::optional<Eigen::Matrix<double, 7, 7>> InverseOfInformation<7>(
    const Eigen::Matrix<double, 7, 7>&);

}  // namespace oaslam
