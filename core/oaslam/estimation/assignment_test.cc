#include "oaslam/estimation/assignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

double BestByEnumeration(const Eigen::MatrixXd& scores) {
  const int size = static_cast<int>(std::max(scores.rows(), scores.cols()));
  std::vector<int> order(size);
  std::iota(order.begin(), order.end(), 0);
  double best = 0;
  do {
    double sum = 0;
    for (int i = 0; i < scores.rows(); ++i)
      if (order[i] < scores.cols()) sum += std::max(scores(i, order[i]), 0.0);
    best = std::max(best, sum);
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

TEST(Assignment, IsOptimalAndOneToOne) {
  Rng rng(1);
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::MatrixXd scores(1 + rng.Index(6), 1 + rng.Index(6));
    for (int i = 0; i < scores.size(); ++i) scores.data()[i] = rng.Uniform(-0.5, 1);
    const std::vector<int> columns = AssignMaximum(scores);
    ASSERT_EQ(static_cast<int>(columns.size()), scores.rows());
    double sum = 0;
    std::vector<char> taken(scores.cols(), 0);
    for (int i = 0; i < scores.rows(); ++i) {
      if (columns[i] < 0) continue;
      EXPECT_GT(scores(i, columns[i]), 0);
      EXPECT_FALSE(taken[columns[i]]);
      taken[columns[i]] = 1;
      sum += scores(i, columns[i]);
    }
    EXPECT_NEAR(sum, BestByEnumeration(scores), 1e-12);
  }
}

TEST(Assignment, EmptyMatrices) {
  EXPECT_TRUE(AssignMaximum(Eigen::MatrixXd(0, 3)).empty());
  EXPECT_EQ(AssignMaximum(Eigen::MatrixXd(2, 0)), std::vector<int>({-1, -1}));
}

}  // namespace
}  // namespace oaslam
