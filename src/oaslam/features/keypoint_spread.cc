#include "oaslam/features/keypoint_spread.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <span>

namespace oaslam {
namespace {

struct Cell {
  cv::Rect2f area;
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

std::vector<Corner> SpreadKeypoints(const std::vector<Corner>& corners, const cv::Rect2f& area,
                                    int count) {
  std::vector<int> indices(corners.size());
  for (size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<int>(i);
  std::vector<Cell> final_cells;
  std::priority_queue<Cell, std::vector<Cell>, SplitLater> open;
  int created = 0;
  const auto add = [&](const cv::Rect2f& place, std::span<int> inside, int depth) {
    if (inside.empty()) return;
    const Cell cell{place, inside, depth, created++};
    if (inside.size() == 1 || depth > 20)
      final_cells.push_back(cell);
    else
      open.push(cell);
  };

  // Start with about square cells.
  const int roots = std::max(1, static_cast<int>(std::lround(area.width / area.height)));
  const float root_width = area.width / static_cast<float>(roots);
  std::span<int> rest(indices);
  for (int r = 0; r < roots; ++r) {
    const float right = area.x + static_cast<float>(r + 1) * root_width;
    const auto end =
        r + 1 == roots ? rest.end() : std::stable_partition(rest.begin(), rest.end(), [&](int i) {
          return static_cast<float>(corners[i].x) < right;
        });
    const auto n = static_cast<size_t>(end - rest.begin());
    add({right - root_width, area.y, root_width, area.height}, rest.first(n), 0);
    rest = rest.subspan(n);
  }
  while (!open.empty() && static_cast<int>(open.size() + final_cells.size()) < count) {
    const Cell cell = open.top();
    open.pop();
    const cv::Size2f half(cell.area.width / 2, cell.area.height / 2);
    const cv::Point2f middle(cell.area.x + half.width, cell.area.y + half.height);
    const auto begin = cell.corners.begin(), end = cell.corners.end();
    const auto is_left = [&](int i) { return static_cast<float>(corners[i].x) < middle.x; };
    const auto y_mid = std::partition(
        begin, end, [&](int i) { return static_cast<float>(corners[i].y) < middle.y; });
    const auto x_top = std::partition(begin, y_mid, is_left);
    const auto x_bottom = std::partition(y_mid, end, is_left);
    add({cell.area.tl(), half}, {begin, x_top}, cell.depth + 1);
    add({{middle.x, cell.area.y}, half}, {x_top, y_mid}, cell.depth + 1);
    add({{cell.area.x, middle.y}, half}, {y_mid, x_bottom}, cell.depth + 1);
    add({middle, half}, {x_bottom, end}, cell.depth + 1);
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
