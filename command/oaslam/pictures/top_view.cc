#include "oaslam/pictures/top_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace oaslam {

void Extent::Add(const Extent& other) {
  if (other.IsEmpty()) return;
  Add(other.low);
  Add(other.high);
}

Extent Extent::Within(const Extent& bounds) const {
  if (IsEmpty() || bounds.IsEmpty()) return *this;
  return {low.cwiseMax(bounds.low).cwiseMin(bounds.high),
          high.cwiseMin(bounds.high).cwiseMax(bounds.low)};
}

Extent QuantileExtent(const Points2& points, double share) {
  Extent extent;
  if (points.empty()) return extent;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> values;
    for (const auto& p : points) values.push_back(p[axis]);
    std::ranges::sort(values);
    const auto skip = static_cast<size_t>(share * static_cast<double>(values.size() - 1));
    extent.low[axis] = values[skip];
    extent.high[axis] = values[values.size() - 1 - skip];
  }
  return extent;
}

PlaneView::PlaneView(const Extent& extent, const Eigen::Vector2d& corner,
                     const Eigen::Vector2d& max_size)
    : corner_(corner) {
  const Extent shown =
      extent.IsEmpty() ? Extent{Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones()} : extent;
  // A straight path gets some space beside it.
  const double smallest = std::max(shown.Side() * 0.4, 1e-9);
  const Eigen::Vector2d span = (shown.high - shown.low).cwiseMax(smallest);
  scale_ = (max_size.array() / span.array()).minCoeff();
  size_ = Eigen::Vector2d(max_size.x(),
                          std::min(max_size.y(), std::max(span.y() * scale_, 0.55 * max_size.x())));
  low_ = (shown.low + shown.high) / 2 - size_ / (2 * scale_);
}

void PlaneView::DrawGrid(SvgCanvas& canvas, double step) const {
  for (int axis = 0; axis < 2; ++axis) {
    const double end = low_[axis] + size_[axis] / scale_;
    for (double v = std::ceil(low_[axis] / step) * step; v < end; v += step) {
      Eigen::Vector2d a = low_, b = low_ + size_ / scale_;
      a[axis] = b[axis] = v;
      canvas.Line((*this)(a), (*this)(b), R"(stroke="#eeeeee" stroke-width="1")");
    }
  }
  canvas.Rectangle(corner_, size_, R"(fill="none" stroke="#bbbbbb" stroke-width="1")");
}

void PlaneView::DrawScaleBar(SvgCanvas& canvas, double step, const std::string& unit) const {
  const Eigen::Vector2d left = corner_ + Eigen::Vector2d(16, size_.y() - 14),
                        right = left + Eigen::Vector2d(step * scale_, 0);
  canvas.Rectangle(left - Eigen::Vector2d(8, 26), {std::max(step * scale_, 60.0) + 16, 34},
                   R"(fill="white" fill-opacity="0.8")");
  canvas.Polyline({left - Eigen::Vector2d(0, 5), left, right, right - Eigen::Vector2d(0, 5)},
                  R"(stroke="#333" stroke-width="1.5")");
  canvas.Text(left - Eigen::Vector2d(0, 9),
              fmt::format("{:g}{}{}", step, unit.empty() ? "" : " ", unit), 12);
}

std::vector<Points2> TopLines(const std::vector<StampedPose>& poses, const TopAxes& axes) {
  std::vector<Points2> lines;
  for (const auto& part : SplitAtGaps(poses)) {
    lines.emplace_back();
    for (const StampedPose& pose : part)
      lines.back().push_back(axes(pose.world_from_cam.translation));
  }
  return lines;
}

}  // namespace oaslam
