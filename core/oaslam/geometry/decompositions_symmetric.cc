#include <Eigen/Cholesky>

#include "oaslam/geometry/decompositions.h"

namespace oaslam {

template <int N>
Eigen::Matrix<double, N, 1> SolveSymmetric(const Eigen::Matrix<double, N, N>& matrix,
                                           const Eigen::Matrix<double, N, 1>& right) {
  return matrix.ldlt().solve(right);
}

template <int N>
Eigen::Matrix<double, N, N> InverseOfSymmetric(const Eigen::Matrix<double, N, N>& matrix) {
  return matrix.ldlt().solve(Eigen::Matrix<double, N, N>::Identity());
}

template <int N>
std::optional<SolutionAndInverse<N>> SolveAndInvertSemidefinite(
    const Eigen::Matrix<double, N, N>& matrix, const Eigen::Matrix<double, N, 1>& right) {
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> factor(matrix);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return std::nullopt;
  return SolutionAndInverse<N>{factor.solve(right),
                               factor.solve(Eigen::Matrix<double, N, N>::Identity())};
}

using FactorInPlace = Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower>;

bool FactorisePositive(Eigen::Ref<Eigen::MatrixXd> matrix) {
  return FactorInPlace(matrix).info() == Eigen::Success;
}

std::optional<Eigen::VectorXd> SolvePositive(Eigen::Ref<Eigen::MatrixXd> matrix,
                                             const Eigen::VectorXd& right) {
  const FactorInPlace factor(matrix);
  if (factor.info() != Eigen::Success) return std::nullopt;
  return factor.solve(right);
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

template Eigen::Matrix<double, 5, 1> SolveSymmetric(const Eigen::Matrix<double, 5, 5>&,
                                                    const Eigen::Matrix<double, 5, 1>&);
template Eigen::Matrix<double, 6, 1> SolveSymmetric(const Eigen::Matrix<double, 6, 6>&,
                                                    const Eigen::Matrix<double, 6, 1>&);
template Eigen::Matrix<double, 7, 1> SolveSymmetric(const Eigen::Matrix<double, 7, 7>&,
                                                    const Eigen::Matrix<double, 7, 1>&);
template Eigen::Matrix<double, 8, 1> SolveSymmetric(const Eigen::Matrix<double, 8, 8>&,
                                                    const Eigen::Matrix<double, 8, 1>&);
template Eigen::Matrix<double, 5, 5> InverseOfSymmetric(const Eigen::Matrix<double, 5, 5>&);
template Eigen::Matrix<double, 6, 6> InverseOfSymmetric(const Eigen::Matrix<double, 6, 6>&);
template std::optional<SolutionAndInverse<7>> SolveAndInvertSemidefinite(
    const Eigen::Matrix<double, 7, 7>&, const Eigen::Matrix<double, 7, 1>&);
template std::optional<Eigen::Matrix<double, 6, 6>> InverseOfInformation(
    const Eigen::Matrix<double, 6, 6>&);
template std::optional<Eigen::Matrix<double, 7, 7>> InverseOfInformation(
    const Eigen::Matrix<double, 7, 7>&);

}  // namespace oaslam
