#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

// A 256-bit binary descriptor.
using Descriptor = std::array<uint64_t, 4>;

inline int HammingDistance(const Descriptor& a, const Descriptor& b) {
  return std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) +
         std::popcount(a[3] ^ b[3]);
}

struct Keypoint {
  Eigen::Vector2f px = Eigen::Vector2f::Zero();  // in the ideal (undistorted) image
  float angle_rad = 0;                           // orientation of the patch, [0, 2 pi)
  uint8_t octave = 0;                            // pyramid level
};

struct PyramidScales {
  static constexpr int kMaxLevels =
      16;  // the image is 15 times smaller there: of 640 px 42 are left
  int levels = 8;
  float factor = 1.2F;
  // Size of a pixel of each level, in pixels of the given image: that of the lowest level times
  // factor^level. The lowest level may differ from the given image, since features are taken at a
  // working resolution. It is also the standard deviation of a key point's position.
  std::array<float, kMaxLevels> scale{};
  // The focal length of the image, divided by that of the images in which landmarks were seen
  // first: what is seen through a lens that zooms in appears as if it were nearer by this factor.
  // Not saved.
  double zoom = 1;

  PyramidScales() : PyramidScales(8, 1.2) {}
  PyramidScales(int level_count, double scale_factor, double lowest = 1);

  // The size of a pixel of the lowest level in pixels of the given image: the unit of all distances
  // that depend on the precision of features.
  double working_pixel() const { return scale[0]; }
  // The scale of a level relative to the lowest.
  double Relative(int level) const { return scale[level] / scale[0]; }
  // The pyramid level at which a point appears at `distance`, if it appears at level 0 at
  // `max_distance` without zoom; within [0, levels).
  int PredictLevel(double distance, double max_distance) const;
};

// The descriptors by which points are compared.
enum class Appearance { kOrb, kLearned };

// Learned descriptors (description/) of some key points of an image.
struct LearnedDescriptors {
  std::vector<uint16_t> keypoints;  // ascending
  std::vector<Descriptor> descriptors;

  bool empty() const { return keypoints.empty(); }
  // Null where the key point has none.
  const Descriptor* Find(uint32_t keypoint) const;
};

// The key points of one image, immutable once extracted, with a grid over the ideal image for
// searches by place.
struct Features {
  static constexpr int kMaxKeypoints = 65535;  // the grid stores 16 bits each

  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;  // ORB; same length
  PyramidScales pyramid;
  Box bounds;  // of the ideal image, pixels
  LearnedDescriptors learned;

  int size() const { return static_cast<int>(keypoints.size()); }

  // The features with these key points only, in this order.
  Features Selected(std::span<const uint32_t> kept) const;

  // Removes the key points in these boxes.
  void EraseKeypointsIn(std::span<const Box> boxes);

  // Fills the grid; call once after keypoints and bounds are set.
  void BuildGrid();

  // Calls visit(index) for each key point within `radius` (in both coordinates) of `px`, in
  // ascending order of cells.
  template <typename Visitor>
  void VisitNear(const Eigen::Vector2d& px, double radius, Visitor&& visit) const;

 private:
  int Column(double x) const;
  int Row(double y) const;
  int columns_ = 0, rows_ = 0;        // of the grid: finer where there are many key points
  std::vector<uint16_t> cell_begin_;  // columns_ * rows_ + 1
  std::vector<uint16_t> cell_items_;
};

inline int Features::Column(double x) const {
  const double c = (x - bounds.x1) * columns_ / bounds.Width();
  return c <= 0 ? 0 : c >= columns_ ? columns_ - 1 : static_cast<int>(c);
}

inline int Features::Row(double y) const {
  const double r = (y - bounds.y1) * rows_ / bounds.Height();
  return r <= 0 ? 0 : r >= rows_ ? rows_ - 1 : static_cast<int>(r);
}

template <typename Visitor>
void Features::VisitNear(const Eigen::Vector2d& px, double radius, Visitor&& visit) const {
  if (cell_begin_.empty() || px.x() + radius < bounds.x1 || px.x() - radius > bounds.x2 ||
      px.y() + radius < bounds.y1 || px.y() - radius > bounds.y2)
    return;
  const int first_column = Column(px.x() - radius), last_column = Column(px.x() + radius);
  const int last_row = Row(px.y() + radius);
  for (int row = Row(px.y() - radius); row <= last_row; ++row) {
    const uint32_t begin = cell_begin_[row * columns_ + first_column];
    const uint32_t end = cell_begin_[row * columns_ + last_column + 1];
    for (uint32_t i = begin; i < end; ++i) {
      const Eigen::Vector2f& p = keypoints[cell_items_[i]].px;
      if (std::abs(p.x() - px.x()) < radius && std::abs(p.y() - px.y()) < radius)
        visit(static_cast<int>(cell_items_[i]));
    }
  }
}

}  // namespace oaslam
