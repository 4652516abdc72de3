#pragma once

#include <Eigen/Core>
#include <vector>

namespace oaslam {

// Returns the one-to-one assignment of rows to columns with the largest sum of scores (Kuhn's
// Hungarian method by shortest augmenting paths): the column of each row, or -1. Pairs with a score
// that is not positive stay unassigned. Scores must be finite.
std::vector<int> AssignMaximum(const Eigen::MatrixXd& scores);

}  // namespace oaslam
