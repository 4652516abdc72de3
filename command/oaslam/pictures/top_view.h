#pragma once

#include <Eigen/Core>
#include <vector>

#include "oaslam/exports/map_scene.h"
#include "oaslam/pictures/svg.h"

namespace oaslam {

struct Extent {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = Eigen::Vector2d::Constant(-1e300);

  bool IsEmpty() const { return !(low.x() <= high.x()); }
  double Side() const { return IsEmpty() ? 0 : (high - low).maxCoeff(); }
  void Add(const Eigen::Vector2d& p) { low = low.cwiseMin(p), high = high.cwiseMax(p); }
  void Add(const Extent& other);
  Extent Grown(double margin) const { return {low.array() - margin, high.array() + margin}; }
  Extent Within(const Extent& bounds) const;
};

// The extent between the quantiles [share, 1 - share] of each coordinate.
Extent QuantileExtent(const Points2& points, double share);

// Maps a plane with uniform scale to a rectangle of the page, y up.
class PlaneView {
 public:
  PlaneView(const Extent& extent, const Eigen::Vector2d& corner, const Eigen::Vector2d& max_size);
  Eigen::Vector2d operator()(const Eigen::Vector2d& p) const {
    return {corner_.x() + (p.x() - low_.x()) * scale_,
            corner_.y() + size_.y() - (p.y() - low_.y()) * scale_};
  }
  double scale() const { return scale_; }  // pixels per unit
  const Eigen::Vector2d& corner() const { return corner_; }
  const Eigen::Vector2d& size() const { return size_; }

  // Draws light lines with distance `step`, and a frame.
  void DrawGrid(SvgCanvas& canvas, double step) const;
  void DrawScaleBar(SvgCanvas& canvas, double step, const std::string& unit) const;

 private:
  Eigen::Vector2d low_, corner_, size_;
  double scale_;
};

// The positions seen from above, split likewise.
std::vector<Points2> TopLines(const std::vector<StampedPose>& poses, const TopAxes& axes);

}  // namespace oaslam
