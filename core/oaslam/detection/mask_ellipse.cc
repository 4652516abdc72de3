#include "oaslam/detection/mask_ellipse.h"

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/ellipse.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// Moments of the cells of a mask: sums of their centres in network pixels.
struct Moments {
  int count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
};

Moments MaskMoments(const cv::Mat& prototypes, const std::vector<float>& coefficients,
                    const Box& box, const Eigen::Vector2d& cell) {
  const int rows = prototypes.size[2], columns = prototypes.size[3];
  // The first cell whose centre is not before an edge.
  const auto cell_at = [](double edge, double size, int count) {
    return static_cast<int>(
        std::clamp(std::ceil(edge / size - 0.5), 0.0, static_cast<double>(count)));
  };
  const auto plane = static_cast<size_t>(rows) * static_cast<size_t>(columns);
  const float* values = prototypes.ptr<float>();
  Moments moments;
  for (int y = cell_at(box.y1, cell.y(), rows); y < cell_at(box.y2, cell.y(), rows); ++y)
    for (int x = cell_at(box.x1, cell.x(), columns); x < cell_at(box.x2, cell.x(), columns); ++x) {
      const float* value =
          values + static_cast<size_t>(y) * static_cast<size_t>(columns) + static_cast<size_t>(x);
      float logit = 0;
      for (size_t i = 0; i < coefficients.size(); ++i) logit += coefficients[i] * value[i * plane];
      if (!(logit > 0)) continue;
      const Eigen::Vector2d center = cell.cwiseProduct(Eigen::Vector2d(x + 0.5, y + 0.5));
      ++moments.count;
      moments.sum += center;
      moments.squares += center * center.transpose();
    }
  return moments;
}

}  // namespace

std::optional<std::array<double, 5>> EllipseFromMask(const cv::Mat& prototypes,
                                                     const std::vector<float>& coefficients,
                                                     const Box& box, const cv::Size& network_size) {
  OASLAM_CHECK(prototypes.dims == 4 && prototypes.depth() == CV_32F && prototypes.isContinuous() &&
               prototypes.size[1] == static_cast<int>(coefficients.size()));
  constexpr int kMinCells = 10;  // with fewer, one cell more or less changes the shape
  const Eigen::Vector2d cell(static_cast<double>(network_size.width) / prototypes.size[3],
                             static_cast<double>(network_size.height) / prototypes.size[2]);
  const Moments m = MaskMoments(prototypes, coefficients, box, cell);
  if (m.count < kMinCells) return std::nullopt;
  const Eigen::Vector2d mean = m.sum / m.count;
  Eigen::Matrix2d covariance = m.squares / m.count - mean * mean.transpose();
  covariance.diagonal() += cell.cwiseAbs2() / 12;  // a cell is an area, not a point
  const PrincipalAxes axes = PrincipalAxesOf(covariance);
  // The variance of a filled ellipse along an axis is a quarter of the half axis squared.
  return std::array{mean.x(), mean.y(), 4 * axes.major, 4 * axes.minor, axes.angle_rad};
}

}  // namespace oaslam
