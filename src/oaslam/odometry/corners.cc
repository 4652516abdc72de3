#include "oaslam/odometry/corners.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace oaslam {
namespace {

constexpr int kMargin = 6;  // px at the edge of the image, where patches would mostly be mirrored
constexpr int kHalfBlock = 2;  // the derivatives of 5 x 5 pixels are summed
// Least weaker eigenvalue of that sum, in squared grey levels per px, so that noise alone is no
// corner; not measured.
constexpr float kLeastStrength = 8;

struct Area {
  int x1, y1, x2, y2;  // pixels [x1, x2) x [y1, y2)
  int width() const { return x2 - x1; }
  int height() const { return y2 - y1; }
};

// The weaker eigenvalue at each pixel of an area that is kMargin away from the edges.
std::vector<float> Strengths(const GreyImage& image, const Area& area) {
  const int width = area.width() + 2 * kHalfBlock, height = area.height() + 2 * kHalfBlock;
  struct Products {
    int32_t xx = 0, xy = 0, yy = 0;
    void Add(const Products& p) { xx += p.xx, xy += p.xy, yy += p.yy; }
  };
  std::vector<Products> products(static_cast<size_t>(width) * height);
  for (int y = 0; y < height; ++y) {
    const uint8_t* row = image.Row(area.y1 - kHalfBlock + y) + area.x1 - kHalfBlock;
    const uint8_t *above = row - image.step, *below = row + image.step;
    for (int x = 0; x < width; ++x) {
      // Sobel's derivatives: eight times the slope.
      const int dx =
          above[x + 1] - above[x - 1] + 2 * (row[x + 1] - row[x - 1]) + below[x + 1] - below[x - 1];
      const int dy =
          below[x - 1] - above[x - 1] + 2 * (below[x] - above[x]) + below[x + 1] - above[x + 1];
      products[y * width + x] = {dx * dx, dx * dy, dy * dy};
    }
  }
  std::vector<Products> columns(static_cast<size_t>(width) * area.height());
  for (int y = 0; y < area.height(); ++y)
    for (int x = 0; x < width; ++x)
      for (int i = 0; i <= 2 * kHalfBlock; ++i)
        columns[y * width + x].Add(products[(y + i) * width + x]);
  std::vector<float> strengths(static_cast<size_t>(area.width()) * area.height());
  for (int y = 0; y < area.height(); ++y)
    for (int x = 0; x < area.width(); ++x) {
      Products sum;
      for (int i = 0; i <= 2 * kHalfBlock; ++i) sum.Add(columns[y * width + x + i]);
      const float half = 0.5F * static_cast<float>(sum.xx + sum.yy),
                  difference = 0.5F * static_cast<float>(sum.xx - sum.yy),
                  xy = static_cast<float>(sum.xy);
      strengths[y * area.width() + x] = (half - std::sqrt(difference * difference + xy * xy)) / 64;
    }
  return strengths;
}

// No corner so near to this place.
void Suppress(const Area& area, const Eigen::Vector2f& px, int radius,
              std::vector<float>& strengths) {
  const int cx = static_cast<int>(std::lround(px.x())), cy = static_cast<int>(std::lround(px.y()));
  for (int y = std::max(area.y1, cy - radius); y < std::min(area.y2, cy + radius + 1); ++y)
    for (int x = std::max(area.x1, cx - radius); x < std::min(area.x2, cx + radius + 1); ++x)
      if ((x - cx) * (x - cx) + (y - cy) * (y - cy) <= radius * radius)
        strengths[(y - area.y1) * area.width() + x - area.x1] = 0;
}

}  // namespace

std::vector<Eigen::Vector2f> FindCorners(const GreyImage& image,
                                         std::span<const Eigen::Vector2f> tracked,
                                         const CornerGrid& grid) {
  struct Found {
    Eigen::Vector2f px;
    float strength = 0;
    int rank = 0;  // in its cell
  };
  const int columns = (image.width + grid.cell - 1) / grid.cell,
            rows = (image.height + grid.cell - 1) / grid.cell, radius = grid.cell / 4;
  std::vector<int> counts(static_cast<size_t>(columns) * rows);
  for (const Eigen::Vector2f& px : tracked) {
    const int column = std::clamp(static_cast<int>(px.x()) / grid.cell, 0, columns - 1),
              row = std::clamp(static_cast<int>(px.y()) / grid.cell, 0, rows - 1);
    ++counts[row * columns + column];
  }
  std::vector<Found> found;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int have = counts[row * columns + column];
      if (have >= grid.per_cell) continue;
      const Area area{std::max(column * grid.cell, kMargin), std::max(row * grid.cell, kMargin),
                      std::min((column + 1) * grid.cell, image.width - kMargin),
                      std::min((row + 1) * grid.cell, image.height - kMargin)};
      if (area.width() < 2 || area.height() < 2) continue;
      std::vector<float> strengths = Strengths(image, area);
      for (const Eigen::Vector2f& px : tracked) Suppress(area, px, radius, strengths);
      for (const Found& f : found) Suppress(area, f.px, radius, strengths);
      for (int rank = have; rank < grid.per_cell; ++rank) {
        const auto best = std::ranges::max_element(strengths);
        if (*best < kLeastStrength) break;
        const int i = static_cast<int>(best - strengths.begin());
        const Eigen::Vector2f px(static_cast<float>(area.x1 + i % area.width()),
                                 static_cast<float>(area.y1 + i / area.width()));
        found.push_back({px, *best, rank});
        Suppress(area, px, radius, strengths);
      }
    }
  std::ranges::stable_sort(found, [](const Found& a, const Found& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.strength > b.strength;
  });
  std::vector<Eigen::Vector2f> corners;
  for (const Found& f : found) {
    if (corners.size() + tracked.size() >= static_cast<size_t>(grid.max_points)) break;
    corners.push_back(f.px);
  }
  return corners;
}

}  // namespace oaslam
