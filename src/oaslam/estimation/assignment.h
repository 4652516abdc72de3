#pragma once

#include <Eigen/Core>
#include <vector>

namespace oaslam {

// The one-to-one assignment of rows to columns with the largest sum of scores (Kuhn's Hungarian
// method by shortest augmenting paths): per row its column, or -1. Pairs whose score is not
// positive stay unassigned. Scores must be finite.
std::vector<int> AssignMaximum(const Eigen::MatrixXd& scores);

}  // namespace oaslam
