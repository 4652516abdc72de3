#include "oaslam/features/features.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "oaslam/geometry/box.h"
#include "oaslam/util/check.h"

namespace oaslam {

PyramidScales::PyramidScales(int level_count, double scale_factor, double lowest)
    : levels(std::min(level_count, kMaxLevels)), factor(static_cast<float>(scale_factor)) {
  double s = lowest;
  for (int i = 0; i < levels; ++i, s *= scale_factor) scale[i] = static_cast<float>(s);
}

int PyramidScales::PredictLevel(double distance, double max_distance) const {
  // At max_distance the landmark appears at level 0; at a distance smaller by factor^n it appears n
  // levels higher.
  const double level =
      std::log(max_distance / (distance / zoom)) / std::log(static_cast<double>(factor));
  return std::clamp(static_cast<int>(std::lround(level)), 0, levels - 1);
}

const Descriptor* LearnedDescriptors::Find(uint32_t keypoint) const {
  const auto at = std::ranges::lower_bound(keypoints, keypoint);
  return at != keypoints.end() && *at == keypoint ? &descriptors[at - keypoints.begin()] : nullptr;
}

void Features::EraseKeypointsIn(std::span<const Box> boxes) {
  OASLAM_CHECK(learned.empty());
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

Features Features::Selected(std::span<const uint32_t> kept) const {
  Features selected;
  selected.pyramid = pyramid;
  selected.bounds = bounds;
  selected.keypoints.reserve(kept.size());
  selected.descriptors.reserve(kept.size());
  for (const uint32_t i : kept) {
    selected.keypoints.push_back(keypoints[i]);
    selected.descriptors.push_back(descriptors[i]);
    if (const Descriptor* described = learned.Find(i)) {
      selected.learned.keypoints.push_back(static_cast<uint16_t>(selected.size() - 1));
      selected.learned.descriptors.push_back(*described);
    }
  }
  selected.BuildGrid();
  return selected;
}

void Features::BuildGrid() {
  OASLAM_CHECK(size() <= kMaxKeypoints);
  // Settled keyframes keep few key points (PackSettledKeyframes): most cells of a fine grid would
  // be empty, and a large map has thousands of such grids.
  constexpr int kMany = 512;
  columns_ = size() > kMany ? 64 : 32;
  rows_ = size() > kMany ? 48 : 24;
  const int cells = columns_ * rows_;
  std::vector<uint16_t> cell(keypoints.size());
  cell_begin_.assign(static_cast<size_t>(cells) + 1, 0);
  for (size_t i = 0; i < keypoints.size(); ++i) {
    cell[i] =
        static_cast<uint16_t>(Row(keypoints[i].px.y()) * columns_ + Column(keypoints[i].px.x()));
    ++cell_begin_[cell[i] + 1];
  }
  std::partial_sum(cell_begin_.begin(), cell_begin_.end(), cell_begin_.begin());
  cell_items_.resize(keypoints.size());
  std::vector<uint16_t> next(cell_begin_.begin(), cell_begin_.end() - 1);
  for (size_t i = 0; i < keypoints.size(); ++i)
    cell_items_[next[cell[i]]++] = static_cast<uint16_t>(i);
}

}  // namespace oaslam
