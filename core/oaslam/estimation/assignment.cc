#include "oaslam/estimation/assignment.h"

#include <limits>

namespace oaslam {
namespace {

// Requires at most as many rows as columns; costs may have any sign. The arrays have one element
// more than the matrix, since index 0 is the root of the augmenting paths.
std::vector<int> MinimumCostColumns(const Eigen::MatrixXd& costs) {
  const int rows = static_cast<int>(costs.rows()), columns = static_cast<int>(costs.cols());
  std::vector<double> row_price(rows + 1, 0), column_price(columns + 1, 0), slack(columns + 1);
  std::vector<int> row_of(columns + 1, 0), previous(columns + 1, 0);
  std::vector<char> used(columns + 1);
  for (int row = 1; row <= rows; ++row) {
    row_of[0] = row;
    int column = 0;
    std::fill(slack.begin(), slack.end(), std::numeric_limits<double>::infinity());
    std::fill(used.begin(), used.end(), 0);
    do {
      used[column] = 1;
      const int from = row_of[column];
      double step = std::numeric_limits<double>::infinity();
      int next = 0;
      for (int j = 1; j <= columns; ++j) {
        if (used[j]) continue;
        const double reduced = costs(from - 1, j - 1) - row_price[from] - column_price[j];
        if (reduced < slack[j]) {
          slack[j] = reduced;
          previous[j] = column;
        }
        if (slack[j] < step) {
          step = slack[j];
          next = j;
        }
      }
      for (int j = 0; j <= columns; ++j) {
        if (used[j]) {
          row_price[row_of[j]] += step;
          column_price[j] -= step;
        } else {
          slack[j] -= step;
        }
      }
      column = next;
    } while (row_of[column] != 0);
    while (column != 0) {
      row_of[column] = row_of[previous[column]];
      column = previous[column];
    }
  }
  std::vector<int> column_of(rows, -1);
  for (int j = 1; j <= columns; ++j)
    if (row_of[j] > 0) column_of[row_of[j] - 1] = j - 1;
  return column_of;
}

}  // namespace

std::vector<int> AssignMaximum(const Eigen::MatrixXd& scores) {
  std::vector<int> columns(scores.rows(), -1);
  if (scores.size() == 0) return columns;
  // A pair that is not worth assigning costs the same as none, so that it is never preferred.
  const Eigen::MatrixXd costs = -scores.cwiseMax(0.0);
  if (costs.rows() <= costs.cols()) {
    columns = MinimumCostColumns(costs);
  } else {
    const std::vector<int> rows = MinimumCostColumns(costs.transpose());
    for (int j = 0; j < static_cast<int>(rows.size()); ++j)
      if (rows[j] >= 0) columns[rows[j]] = j;
  }
  for (int i = 0; i < static_cast<int>(columns.size()); ++i)
    if (columns[i] >= 0 && !(scores(i, columns[i]) > 0)) columns[i] = -1;
  return columns;
}

}  // namespace oaslam
