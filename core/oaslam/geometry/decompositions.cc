#include "oaslam/geometry/decompositions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
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

Eigen::Quaterniond TurnBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

template <int N>
Eigen::Matrix<double, N, N> InverseOf(const Eigen::Matrix<double, N, N>& matrix) {
  return matrix.inverse();
}

template Eigen::Matrix<double, 6, 6> InverseOf(const Eigen::Matrix<double, 6, 6>&);
template Eigen::Matrix<double, 7, 7> InverseOf(const Eigen::Matrix<double, 7, 7>&);
template Eigen::Matrix<double, 8, 8> InverseOf(const Eigen::Matrix<double, 8, 8>&);

}  // namespace oaslam
