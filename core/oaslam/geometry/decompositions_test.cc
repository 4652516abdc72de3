#include "oaslam/geometry/decompositions.h"

#include <gtest/gtest.h>

#include <cmath>

namespace oaslam {
namespace {

template <int N>
Eigen::Matrix<double, N, N> PositiveMatrix() {
  Eigen::Matrix<double, N, N> matrix;
  for (int i = 0; i < N; ++i)
    for (int k = 0; k < N; ++k) matrix(i, k) = 1.0 / (1 + i + k) + (i == k ? 1 + 0.1 * i : 0);
  return matrix;
}

TEST(Decompositions, TheSmallestTurnIsFoundAlsoBetweenOppositeDirections) {
  const Eigen::Vector3d from(1, 2, 3);
  for (const Eigen::Vector3d& to : {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(-from)}) {
    const Eigen::Quaterniond turn = TurnBetween(from, to);
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-9);
    EXPECT_NEAR(turn.angularDistance(Eigen::Quaterniond::Identity()),
                std::acos(from.normalized().dot(to.normalized())), 1e-6);
  }
}

TEST(Decompositions, SolutionsAndInversesAreThoseOfTheMatrix) {
  const Eigen::Matrix<double, 7, 7> matrix = PositiveMatrix<7>();
  const Eigen::Matrix<double, 7, 1> x = Eigen::Matrix<double, 7, 1>::LinSpaced(-1, 2);
  const auto identity = Eigen::Matrix<double, 7, 7>::Identity();
  const auto solved = SolveAndInvertSemidefinite<7>(matrix, matrix * x);
  ASSERT_TRUE(solved);
  EXPECT_TRUE(solved->solution.isApprox(x, 1e-12));
  EXPECT_TRUE((solved->inverse * matrix).isApprox(identity, 1e-12));
  EXPECT_TRUE((InverseOf<7>(matrix) * matrix).isApprox(identity, 1e-12));
  EXPECT_TRUE(InverseOfSymmetric<6>(PositiveMatrix<6>())
                  .isApprox(InverseOf<6>(PositiveMatrix<6>()), 1e-12));
  EXPECT_FALSE(SolveAndInvertSemidefinite<7>(-matrix, x));
}

TEST(Decompositions, OnlyTheLowerHalfIsReadAndReplacedByItsFactor) {
  const Eigen::MatrixXd matrix = PositiveMatrix<6>();
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(6, -1, 2);
  Eigen::MatrixXd factor = matrix;
  factor.triangularView<Eigen::StrictlyUpper>().setConstant(9);
  const auto solution = SolvePositive(factor, matrix * x);
  ASSERT_TRUE(solution);
  EXPECT_TRUE(solution->isApprox(x, 1e-12));
  EXPECT_EQ(factor(0, 5), 9);
  const Eigen::MatrixXd lower = factor.triangularView<Eigen::Lower>();
  EXPECT_TRUE((lower * lower.transpose()).isApprox(matrix, 1e-12));
  Eigen::MatrixXd indefinite = -matrix;
  EXPECT_FALSE(FactorisePositive(indefinite));
}

}  // namespace
}  // namespace oaslam
