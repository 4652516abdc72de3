#include "oaslam/odometry/image_shift.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace oaslam {
namespace {

// An image of at most `kMostPixels` along its longer side, by square blocks.
struct SmallImage {
  static constexpr int kMostPixels = 40;

  explicit SmallImage(const GreyImage& image) {
    const int longer = std::max(image.width, image.height);
    block = (longer + kMostPixels - 1) / kMostPixels;
    width = image.width / block;
    height = image.height / block;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        int64_t sum = 0;
        for (int v = 0; v < block; ++v)
          for (int u = 0; u < block; ++u) sum += image.Row(y * block + v)[x * block + u];
        pixels.push_back(sum);
      }
  }

  const int64_t* Row(int y) const { return pixels.data() + std::ptrdiff_t{y} * width; }

  int block = 1, width = 0, height = 0;
  std::vector<int64_t> pixels;  // sums of blocks
};

// The correlation of what both images show where the second one has moved by this shift.
double CorrelationAtShift(const SmallImage& a, const SmallImage& b, int dx, int dy) {
  int64_t sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  const int first_x = std::max(0, -dx), end_x = std::min(a.width, a.width - dx),
            first_y = std::max(0, -dy), end_y = std::min(a.height, a.height - dy);
  for (int y = first_y; y < end_y; ++y) {
    const int64_t *row_a = a.Row(y), *row_b = b.Row(y + dy) + dx;
    for (int x = first_x; x < end_x; ++x) {
      sum_a += row_a[x];
      sum_b += row_b[x];
      aa += row_a[x] * row_a[x];
      bb += row_b[x] * row_b[x];
      ab += row_a[x] * row_b[x];
    }
  }
  const auto n = static_cast<double>((end_x - first_x) * (end_y - first_y));
  const auto mean = [&](int64_t sum) { return static_cast<double>(sum) / n; };
  const double variance_a = mean(aa) - mean(sum_a) * mean(sum_a),
               variance_b = mean(bb) - mean(sum_b) * mean(sum_b);
  if (variance_a <= 0 || variance_b <= 0) return 0;
  return (mean(ab) - mean(sum_a) * mean(sum_b)) / std::sqrt(variance_a * variance_b);
}

}  // namespace

Eigen::Vector2f ShiftOfImage(const GreyPyramid& last, const GreyPyramid& next) {
  constexpr double kMost = 0.67;  // of each side: what is left is too little to compare
  const int level = last.levels() - 1;
  const SmallImage a(last.level(level)), b(next.level(level));
  const int most_x = static_cast<int>(kMost * a.width), most_y = static_cast<int>(kMost * a.height);
  double best = CorrelationAtShift(a, b, 0, 0);
  Eigen::Vector2f shift = Eigen::Vector2f::Zero();
  for (int dy = -most_y; dy <= most_y; ++dy)
    for (int dx = -most_x; dx <= most_x; ++dx)
      if (const double correlation = CorrelationAtShift(a, b, dx, dy); correlation > best) {
        best = correlation;
        shift = Eigen::Vector2f(static_cast<float>(dx), static_cast<float>(dy));
      }
  return shift * static_cast<float>(a.block << level);
}

}  // namespace oaslam
