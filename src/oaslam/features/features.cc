#include "oaslam/features/features.h"

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/box.h"

namespace oaslam {

PyramidScales::PyramidScales(int level_count, double scale_factor, double lowest)
    : levels(std::min(level_count, kMaxLevels)), factor(static_cast<float>(scale_factor)) {
  double s = lowest;
  for (int i = 0; i < levels; ++i, s *= scale_factor) scale[i] = static_cast<float>(s);
}

int PyramidScales::PredictLevel(double distance, double max_distance) const {
  // At max_distance the landmark appears at level 0; at a distance smaller by factor^n it appears n
  // levels higher.
  const double level = std::log(max_distance / distance) / std::log(static_cast<double>(factor));
  return std::clamp(static_cast<int>(std::lround(level)), 0, levels - 1);
}

void Features::EraseKeypointsIn(std::span<const Box> boxes) {
  const auto is_in = [&](const Keypoint& k) {
    const double x = k.px.x() + kBoxFromPixel, y = k.px.y() + kBoxFromPixel;
    return std::ranges::any_of(
        boxes, [&](const Box& b) { return x >= b.x1 && x <= b.x2 && y >= b.y1 && y <= b.y2; });
  };
  size_t kept = 0;
  for (size_t i = 0; i < keypoints.size(); ++i) {
    if (is_in(keypoints[i])) continue;
    keypoints[kept] = keypoints[i];
    descriptors[kept++] = descriptors[i];
  }
  keypoints.resize(kept);
  descriptors.resize(kept);
  BuildGrid();
}

void Features::BuildGrid() {
  constexpr int kCells = kGridColumns * kGridRows;
  std::vector<uint32_t> cell(keypoints.size());
  cell_begin_.assign(kCells + 1, 0);
  for (size_t i = 0; i < keypoints.size(); ++i) {
    cell[i] = Row(keypoints[i].px.y()) * kGridColumns + Column(keypoints[i].px.x());
    ++cell_begin_[cell[i] + 1];
  }
  for (int c = 0; c < kCells; ++c) cell_begin_[c + 1] += cell_begin_[c];
  cell_items_.resize(keypoints.size());
  std::vector<uint32_t> next(cell_begin_.begin(), cell_begin_.end() - 1);
  for (uint32_t i = 0; i < keypoints.size(); ++i) cell_items_[next[cell[i]]++] = i;
}

}  // namespace oaslam
