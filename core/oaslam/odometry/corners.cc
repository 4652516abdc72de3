#include "oaslam/odometry/corners.h"

#include <algorithm>
#include <cmath>

#include "oaslam/odometry/corner_kernels.h"

namespace oaslam {
namespace {

constexpr int kMargin = 6;  // px at the edge of the image, where patches would mostly be mirrored
// Least weaker eigenvalue of that sum, in squared grey levels per px, so that noise alone is no
// corner; not measured.
constexpr float kLeastStrength = 8;

// No corner within `radius` of this pixel.
void Suppress(const ImageArea& area, const Eigen::Vector2i& at, int radius,
              std::vector<float>& strengths) {
  if (at.x() + radius < area.x1 || at.x() - radius >= area.x2) return;
  for (int y = std::max(area.y1, at.y() - radius); y < std::min(area.y2, at.y() + radius + 1); ++y)
    for (int x = std::max(area.x1, at.x() - radius); x < std::min(area.x2, at.x() + radius + 1);
         ++x)
      if ((x - at.x()) * (x - at.x()) + (y - at.y()) * (y - at.y()) <= radius * radius)
        strengths[(y - area.y1) * area.width() + x - area.x1] = 0;
}

}  // namespace

std::vector<Eigen::Vector2f> FindCorners(const GreyImage& image,
                                         std::span<const Eigen::Vector2f> tracked,
                                         const CornerGrid& grid) {
  struct Found {
    Eigen::Vector2i px;
    float strength = 0;
    int rank = 0;  // in its cell
  };
  const int columns = (image.width + grid.cell - 1) / grid.cell,
            rows = (image.height + grid.cell - 1) / grid.cell, radius = grid.cell / 4;
  std::vector<int> counts(static_cast<size_t>(columns) * rows);
  std::vector<Eigen::Vector2i> taken;  // pixels
  for (const Eigen::Vector2f& px : tracked) {
    const int column = std::clamp(static_cast<int>(px.x()) / grid.cell, 0, columns - 1),
              row = std::clamp(static_cast<int>(px.y()) / grid.cell, 0, rows - 1);
    ++counts[row * columns + column];
    taken.emplace_back(std::lround(px.x()), std::lround(px.y()));
  }
  std::vector<Found> found;
  std::vector<float> strengths;
  CornerScratch scratch;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int have = counts[row * columns + column];
      if (have >= grid.per_cell) continue;
      const ImageArea area{std::max(column * grid.cell, kMargin),
                           std::max(row * grid.cell, kMargin),
                           std::min((column + 1) * grid.cell, image.width - kMargin),
                           std::min((row + 1) * grid.cell, image.height - kMargin)};
      if (area.width() < 2 || area.height() < 2) continue;
      CornerStrengths(image, area, scratch, strengths);
      for (const Eigen::Vector2i& at : taken) Suppress(area, at, radius, strengths);
      for (int rank = have; rank < grid.per_cell; ++rank) {
        const int i = IndexOfLargest(strengths);
        if (strengths[i] < kLeastStrength) break;
        const Eigen::Vector2i at(area.x1 + i % area.width(), area.y1 + i / area.width());
        found.push_back({at, strengths[i], rank});
        taken.push_back(at);
        Suppress(area, at, radius, strengths);
      }
    }
  std::ranges::stable_sort(found, [](const Found& a, const Found& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.strength > b.strength;
  });
  std::vector<Eigen::Vector2f> corners;
  for (const Found& f : found) {
    if (corners.size() + tracked.size() >= static_cast<size_t>(grid.max_points)) break;
    corners.push_back(f.px.cast<float>());
  }
  return corners;
}

}  // namespace oaslam
