#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/odometry/inertial.h"
#include "oaslam/odometry/inverse_depth_problem.h"
#include "oaslam/odometry/patch_edge.h"
#include "oaslam/odometry/turn.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// An image whose pose the odometry still uses.
struct WindowImage {
  int id = 0;  // ascends with time
  double time_s = 0;
  Rigid3 cam_from_odom;
  bool is_keyframe = false;
  bool is_held = false;             // its pose is no longer changed
  double median_inverse_depth = 1;  // of what it sees
  std::optional<Turn> turn{};       // from the image before, by a gyroscope if there is one
  std::optional<Push> push{};       // the same, by an accelerometer; only with a turn
  // What the images up to this one told of the inertial unknowns; of keyframes alone.
  std::shared_ptr<const InertialPrior> told{};
};

// An inverse depth by a depth camera, in the unit of the odometry.
struct MeasuredInverseDepth {
  double value = 1, sigma = 1;
};

// A point seen again in an image after its anchor.
struct Sighting {
  int image = 0;        // id
  Eigen::Vector2f px;   // in the tracked image
  Eigen::Vector2d ray;  // ideal
  bool is_outlier = false;
  bool fits = true;                                // within WindowOptions::outlier_px
  std::optional<MeasuredInverseDepth> measured{};  // there
};

struct WindowPoint {
  int anchor = 0;  // id of the image that saw it first
  Eigen::Vector2f anchor_px = Eigen::Vector2f::Zero();
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  // in the anchor
  PatchEdge edge{};                               // in the anchor
  double inverse_depth = 1, variance = 1;
  double prior_inverse_depth = 1, prior_sigma = 1;
  bool is_measured = false;           // the prior is a measurement by a depth camera
  std::vector<Sighting> sightings{};  // by image

  // In the newest image.
  Eigen::Vector2f px = Eigen::Vector2f::Zero();
  bool is_tracked = true;
  // How the patch of the point in an earlier keyframe, by id, was stretched in the newest image
  // (PatchPose).
  int stretched_from = -1;
  Eigen::Matrix2f stretch = Eigen::Matrix2f::Identity();

  // Where an image saw the point; null if it did not.
  const Eigen::Vector2f* PxIn(int image) const;
  const Eigen::Vector2d* RayIn(int image) const;
  void SetMeasured(const MeasuredInverseDepth& measured);
  // Whether the depth is known to a third: then it helps to guess the depths of neighbouring
  // points.
  bool HasDepth() const { return variance < 0.1 * inverse_depth * inverse_depth; }
  // Whether the depth is known to a tenth.
  bool HasGoodDepth() const { return variance < 0.01 * inverse_depth * inverse_depth; }
  // Whether the sighting before the newest one fitted. If not, the newest sighting gives no new
  // information.
  bool DidFit() const { return sightings.size() < 2 || sightings[sightings.size() - 2].fits; }
};

struct WindowOptions {
  // The standard deviation of a track, including its drift over some ten images. The sigmas are the
  // prototype's (docs/lab/odometry.md); others were not tried.
  double sigma_px = 0.7;
  double huber_sigmas = 1.5;
  // Of the pseudo-Huber loss of sightings. Many sightings have similar errors of one to
  // three pixels: points on edges in front of a wall, in reflections, on bare walls. Losses that
  // are not convex make wrong motions into minima (docs/lab/odometry.md).
  double corner_chi2 = 0.5;
  // About kMostSigmas times sigma_px; a sighting that is off by more is an outlier.
  double outlier_px = 3;
  // As outlier_px, for a point whose depth is well known: where such points do not fit, the newest
  // poses may be wrong, and without these points the scale would be lost, too
  // (docs/lab/odometry.md).
  double known_outlier_px = 10;
  // The standard deviation of the change of velocity in a second, for a camera held by hand; median
  // depths per second.
  double velocity_sigma = 1.5;
  // The standard deviation of the change of angular velocity in one second, rad/s, which is
  // modelled as a random walk. The odometry learns the value from the images so far.
  double turn_rate_sigma = 0.7;
  double focal_px = 500;  // of the tracked image
};

// Two images whose distance is the unit of length, while the second one is free.
struct UnitLength {
  int first = 0, second = 0;  // ids
  double length = 1;
};

// The newest images and keyframes with the points they see. A window is a value: a hypothesis of
// the motion is a copy of it.
struct Window {
  std::vector<WindowImage> images;  // by id
  std::vector<WindowPoint> points;
  double median_inverse_depth = 1;  // of what the newest image sees, smoothed
  std::optional<UnitLength> unit;
  std::optional<WindowInertial> inertial;  // once accelerations have told the length of a metre

  bool Has(int id) const;
  const WindowImage& Image(int id) const;
  WindowImage& Image(int id);
  const WindowImage& newest() const { return images.back(); }
  WindowImage& newest() { return images.back(); }

  // x_from_image of each image, for a pose x_from_odom.
  std::vector<Rigid3> FromImages(const Rigid3& x_from_odom) const;
  // The index of an image in `images`.
  size_t IndexOf(int id) const;

  double InverseDepthIn(const WindowPoint& point, const WindowImage& image) const;

  // Removes an image with its sightings; points that it saw first get the next sighting as anchor.
  void Remove(int id);
  // Removes points and held images that no free image depends on any more, except `kept_image`.
  void RemoveUnused(int kept_image);

 private:
  // Erases images, by index. The turn and the push of an image are from the image before it: those
  // of the next image that stays are composed with those of the erased ones before it.
  void EraseImages(const std::vector<bool>& is_erased);
};

// The least-squares problem of a window, and how its parts are found again.
struct WindowProblem {
  InverseDepthProblem problem;
  std::vector<int> images;  // index into Window::images, by pose
  std::vector<int> points;  // index into Window::points, by point

  InverseDepthState StateOf(const Window& window) const;
  void Apply(const InverseDepthState& state, Window& window) const;
  // The pose of an image.
  int PoseOf(const Window& window, int image) const;
};

// All images that are not held are free. `with_outliers`: sightings that are flagged as outliers
// take part, too.
WindowProblem ProblemOf(const Window& window, const WindowOptions& options, bool with_outliers);

// The triple of an image, which is given by its index in the window, and the two before it; nothing
// where the accelerometer did not measure all of it. Its poses and its sigma are not set.
std::optional<InertialTriple> TripleOf(const Window& window, size_t last);

// How the images agree with a window.
struct WindowFit {
  int inliers = 0;   // sightings in the newest image that fit, of the points counted in `compared`
  int compared = 0;  // points seen in the newest image whose previous sighting fitted
  // Mean squared error of the sightings of the last half second, in sigmas; a sighting counts at
  // most as one that is off by four.
  double cost = 0;
};

// Flags outliers among the sightings of free images by their present residuals. Only points whose
// sighting in the newest image is an inlier are tracked further.
WindowFit FlagOutliers(const WindowOptions& options, Window& window);

// Sets Window::median_inverse_depth from the points that the newest image sees; `smoothed`: moves
// it a fifth of the way.
void UpdateMedianDepth(bool smoothed, Window& window);

}  // namespace oaslam
