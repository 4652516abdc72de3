#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "oaslam/exports/svg.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// The ground plane seen from above: `right` and `forward` span it, `up` looks at the reader.
struct TopAxes {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX(), forward = Eigen::Vector3d::UnitZ(),
                  up = -Eigen::Vector3d::UnitY();

  Eigen::Vector2d operator()(const Eigen::Vector3d& x) const {
    return {right.dot(x), forward.dot(x)};
  }
};

// `up` if given, else the mean up of the cameras; the first camera looks
// towards the top of the page.
TopAxes FindTopAxes(const std::vector<Rigid3>& world_from_cams,
                    const std::optional<Eigen::Vector3d>& up);

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

// Splits a trajectory at gaps in time and where time goes back (the next run).
std::vector<std::vector<StampedPose>> SplitAtGaps(const std::vector<StampedPose>& poses);
// The positions seen from above, split likewise.
std::vector<Points2> TopLines(const std::vector<StampedPose>& poses, const TopAxes& axes);

}  // namespace oaslam
