#include "oaslam/features/keypoint_spread.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <span>

namespace oaslam {
namespace {

struct Cell {
  Box area;
  std::span<int> corners;  // indices; a range of one shared array
  int depth = 0;
  int order = 0;  // order of creation: decides ties
};

// Larger cells first, then fuller ones.
struct SplitLater {
  bool operator()(const Cell& a, const Cell& b) const {
    if (a.depth != b.depth) return a.depth > b.depth;
    if (a.corners.size() != b.corners.size()) return a.corners.size() < b.corners.size();
    return a.order > b.order;
  }
};

}  // namespace

std::vector<Corner> SpreadKeypoints(const std::vector<Corner>& corners, const Box& area,
                                    int count) {
  std::vector<int> indices(corners.size());
  for (size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<int>(i);
  std::vector<Cell> final_cells;
  std::priority_queue<Cell, std::vector<Cell>, SplitLater> open;
  int created = 0;
  const auto add = [&](const Box& place, std::span<int> inside, int depth) {
    if (inside.empty()) return;
    const Cell cell{place, inside, depth, created++};
    if (inside.size() == 1 || depth > 20)
      final_cells.push_back(cell);
    else
      open.push(cell);
  };

  // Start with about square cells.
  const int roots = std::max(1, static_cast<int>(std::lround(area.Width() / area.Height())));
  const double root_width = area.Width() / roots;
  std::span<int> rest(indices);
  for (int r = 0; r < roots; ++r) {
    const double right = area.x1 + (r + 1) * root_width;
    const auto end =
        r + 1 == roots ? rest.end() : std::stable_partition(rest.begin(), rest.end(), [&](int i) {
          return corners[i].x < right;
        });
    const auto n = static_cast<size_t>(end - rest.begin());
    add({right - root_width, area.y1, right, area.y2}, rest.first(n), 0);
    rest = rest.subspan(n);
  }
  while (!open.empty() && static_cast<int>(open.size() + final_cells.size()) < count) {
    const Cell cell = open.top();
    open.pop();
    const auto [x1, y1, x2, y2] = cell.area;
    const Eigen::Vector2d middle = cell.area.Center();
    const auto begin = cell.corners.begin(), end = cell.corners.end();
    const auto is_left = [&](int i) { return corners[i].x < middle.x(); };
    const auto y_mid = std::partition(begin, end, [&](int i) { return corners[i].y < middle.y(); });
    const auto x_top = std::partition(begin, y_mid, is_left);
    const auto x_bottom = std::partition(y_mid, end, is_left);
    add({x1, y1, middle.x(), middle.y()}, {begin, x_top}, cell.depth + 1);
    add({middle.x(), y1, x2, middle.y()}, {x_top, y_mid}, cell.depth + 1);
    add({x1, middle.y(), middle.x(), y2}, {y_mid, x_bottom}, cell.depth + 1);
    add({middle.x(), middle.y(), x2, y2}, {x_bottom, end}, cell.depth + 1);
  }
  for (; !open.empty(); open.pop()) final_cells.push_back(open.top());

  std::vector<Corner> chosen;
  chosen.reserve(final_cells.size());
  for (const Cell& cell : final_cells) {
    const int best = *std::ranges::max_element(cell.corners, [&](int a, int b) {
      return corners[a].score != corners[b].score ? corners[a].score < corners[b].score : a > b;
    });
    chosen.push_back(corners[best]);
  }
  return chosen;
}

}  // namespace oaslam
