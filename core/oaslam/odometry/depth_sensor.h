#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "oaslam/features/depth_map.h"
#include "oaslam/odometry/depth_trust.h"
#include "oaslam/odometry/inverse_depth_solver.h"
#include "oaslam/odometry/window.h"

namespace oaslam {

// The depth camera beside the odometry's camera, if there is one: its depths of the newest images,
// the length of a metre that they tell, and whether the images contradict them. Pixels are those of
// the tracked image, `window` is the odometry's.
class DepthSensor {
 public:
  // Of points that are followed: so many determine a pose as well as those of a beginning by
  // images.
  static constexpr int kLeastDepths = 60;

  // `center`: the principal point. `scale`: the pixels of the camera's image in one of the tracked
  // image.
  DepthSensor(const Eigen::Vector2d& center, double scale) : center_(center), scale_(scale) {}

  // The depths of the newest image; null: none. Depths that are refused are not used.
  void Take(double time_s, const std::shared_ptr<const DepthMap>& depth);
  // Whether so many of the followed points have a depth that a motion may begin with them.
  bool CanBegin(const Window& window) const;
  // A run begins with the newest image, in metres if it has depths; returns whether it has.
  bool BeginInMetres();
  void ForgetMetre() { units_per_metre_ = 0; }
  // The length of a metre in the odometry's unit; 0: not known.
  double units_per_metre() const { return units_per_metre_; }
  bool is_refused() const { return is_refused_; }

  // The inverse depth that was measured there, and its standard deviation, by units; nothing while
  // the length of a metre is not known.
  std::optional<MeasuredInverseDepth> At(const Eigen::Vector2f& px) const;
  // Sets what was measured at the sightings of the newest image.
  void MeasureSightings(Window& window) const;
  // Of a run that began without depths: the length of a metre, once points have both a depth that
  // was measured and one by their parallax.
  void LearnMetre(const Window& window);
  // Compares, from time to time, depths with those that the images alone tell, but for their unit;
  // depths that contradict them are not used any more.
  void Judge(const WindowOptions& options, InverseDepthSolver& solver, Window& window);

 private:
  std::optional<MeasuredDepth> DepthAt(const Eigen::Vector2f& px) const;
  void Remember(double time_s);
  const DepthMap* MapNear(double time_s) const;
  const WindowImage& ImageToJudge(const Window& window) const;
  std::array<DepthTrust::Views, DepthTrust::kReadings.size()> View(
      const Window& free, std::span<const int> points, std::span<const double> variances,
      const WindowImage& image) const;
  void Refuse(Window& window);

  Eigen::Vector2d center_;
  double scale_ = 1;
  std::shared_ptr<const DepthMap> map_;  // of the newest image; null: none, or refused
  double units_per_metre_ = 0;           // of this run
  DepthTrust trust_;
  // By time in seconds, where they will be judged soon.
  std::map<double, std::shared_ptr<const DepthMap>> recent_;
  bool is_refused_ = false;
};

// Compares the depth of a point, which was just optimised, with what its parallax alone says; a
// measurement that contradicts it is of another surface, and is not used.
// `median_inverse_depth`: of the window.
void CompareWithParallax(double median_inverse_depth, WindowPoint& point);

}  // namespace oaslam
