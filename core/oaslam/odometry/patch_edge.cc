#include "oaslam/odometry/patch_edge.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace oaslam {
namespace {

constexpr int kEdgeHalf = 5;  // of the patch, as where patches are fitted (patch_fit)

// How much of a change across an edge is taken for a shift along it. .2 to 1 do alike in thirteen
// walks (docs/lab/odometry.md).
constexpr double kLeak = 0.3;
// A perfect edge is taken for one with this share of the slopes along it.
constexpr double kLeastRatio = 1e-3;

}  // namespace

PatchEdge PatchEdge::In(const Rigid3& image_from_here) const {
  const Eigen::Vector2d turned =
      image_from_here.rotation.toRotationMatrix().topLeftCorner<2, 2>() * along;
  const double length = turned.norm();
  return {length > 0 ? Eigen::Vector2d(turned / length) : along, slide};
}

Eigen::Matrix2d PatchEdge::Covariance() const {
  return Eigen::Matrix2d::Identity() + (slide * slide - 1) * along * along.transpose();
}

Eigen::Matrix2d PatchEdge::RootOfInformation() const {
  return Eigen::Matrix2d::Identity() - (1 - 1 / slide) * along * along.transpose();
}

PatchEdge EdgeAt(const GreyImage& image, const Eigen::Vector2f& px) {
  const int x0 = static_cast<int>(px.x()), y0 = static_cast<int>(px.y());
  int64_t sum_xx = 0, sum_xy = 0, sum_yy = 0;
  for (int y = std::max(1, y0 - kEdgeHalf); y <= std::min(image.height - 2, y0 + kEdgeHalf); ++y) {
    const uint8_t *above = image.Row(y - 1), *row = image.Row(y), *below = image.Row(y + 1);
    for (int x = std::max(1, x0 - kEdgeHalf); x <= std::min(image.width - 2, x0 + kEdgeHalf); ++x) {
      const int dx = row[x + 1] - row[x - 1], dy = below[x] - above[x];
      sum_xx += dx * dx;
      sum_xy += dx * dy;
      sum_yy += dy * dy;
    }
  }
  // The eigenvalues of the sums, and the direction of the weaker one.
  const auto xx = static_cast<double>(sum_xx), xy = static_cast<double>(sum_xy),
             yy = static_cast<double>(sum_yy);
  const double mean = 0.5 * (xx + yy), apart = std::sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
  const double strong = mean + apart, weak = std::max(mean - apart, kLeastRatio * strong);
  if (strong <= 0) return {};
  // Of the two rows of the tensor less the eigenvalue the longer one tells it.
  const Eigen::Vector2d along =
      xx > yy ? Eigen::Vector2d(xy, mean - apart - xx) : Eigen::Vector2d(mean - apart - yy, xy);
  const double length = along.norm();
  if (length <= 0) return {};
  return {along / length, std::sqrt(1 + kLeak * kLeak * (strong / weak - 1))};
}

}  // namespace oaslam
