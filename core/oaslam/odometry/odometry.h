#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "oaslam/angular_velocity.h"
#include "oaslam/camera.h"
#include "oaslam/features/depth_map.h"
#include "oaslam/features/image_mask.h"
#include "oaslam/imu.h"
#include "oaslam/odometry/beginning.h"
#include "oaslam/odometry/corners.h"
#include "oaslam/odometry/depth_sensor.h"
#include "oaslam/odometry/grey_pyramid.h"
#include "oaslam/odometry/inertial_sensor.h"
#include "oaslam/odometry/inverse_depth_solver.h"
#include "oaslam/odometry/lens_watch.h"
#include "oaslam/odometry/rivals.h"
#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

struct OdometryOptions {
  int max_width = 960;     // of the tracked image: larger ones are halved until they fit
  int window = 15;         // free keyframes
  int recent = 2;          // free images that are no keyframes
  int max_beginning = 14;  // keyframes before the motion is known; with more the first is dropped
  CornerGrid grid;
  BeginningOptions beginning;
  // Follows the focal length of a lens that zooms or focuses (LensWatch).
  bool watches_lens = false;
};

// What sensors beside the camera measured. The samples of a gyroscope or an IMU ascend, too, over
// all calls; they should reach up to a quarter of a second beyond the image, the most that their
// clock may be ahead of the camera's.
struct OdometrySensors {
  std::span<const AngularVelocity> angular_velocity{};
  std::span<const ImuSample> imu{};
  std::shared_ptr<const DepthMap> depth{};
};

enum class OdometryState {
  kPreliminary,  // by the motion that explains the images best so far
  kTracking,
  kUncertain,  // many points do not fit, as in blurred images: the pose may be off by degrees
  kInertial,   // as kBlind, but the accelerations since the last image that showed something tell
               // the pose, for a second or two
  kBlind,  // too few points agree on a pose, or too small a share of them, as without texture or at
           // a cut: the pose is a guess, and must not be reported
};
const char* ToString(OdometryState state);

// The inverse depth of a point that is followed.
struct OdometryDepth {
  Eigen::Vector2d ray;  // in the camera's frame, z = 1
  double inverse_depth = 0;
};

struct OdometryEstimate {
  OdometryState state = OdometryState::kPreliminary;
  // Counts how often the motion was interrupted, by images without texture, by a cut, or where too
  // many points did not fit, as in blurred images. The transformation between the frames of two
  // runs is not known.
  int run = 0;
  Rigid3 cam_from_odom;
  // Covariance of a PoseVector, from the last optimisation of the window alone. It orders estimates
  // by their risk, but is too small in a wrong minimum: 1 or 2 % where the error is 15 %.
  PoseCovariance covariance = PoseCovariance::Zero();
  // The accumulated variance of the logarithm of the scale since the odometry began; the difference
  // of two images is the variance between them.
  double scale_drift = 0;
  int image = 0;  // counted since the motion was begun
  // cam_from_odom of the window's keyframes by the present estimate, by image, ascending; these
  // poses replace earlier ones of the same keyframes. Empty while the motion is preliminary.
  std::vector<std::pair<int, Rigid3>> keyframes;
  // With this image the odometry replaced the motion of its newest images by another
  // (BetterMotion): the poses that it had given since the image of this number were wrong.
  std::optional<int> exchanged_since{};
  int tracked = 0;  // points followed into this image, of those that fitted before
  int inliers = 0;
  bool is_keyframe = false;
  // The focal length of the image, divided by that of the camera; 1 unless the lens was seen to
  // change.
  double focal_ratio = 1;
  // The length of the odometry's unit in metres, and its standard deviation, divided by it; 0:
  // not known.
  double metres_per_unit = 0, metre_sigma = 0;
  bool metre_is_by_depth = false;  // by a depth camera, not by an IMU
  // Along the camera's axes, m/s^2, by the accelerometer.
  std::optional<Eigen::Vector3d> gravity_in_cam{};
};

// Visual odometry of one camera: the pose of every image in a frame of its own, in the unit of the
// median depth at the beginning, or in metres where depths are measured, without a map. Points are
// followed by their patches; a window of keyframes with inverse depths is optimised at each image.
class Odometry {
 public:
  Odometry(const Camera& camera, const OdometryOptions& options, uint64_t seed);

  // `image` has the camera's size; times ascend.
  OdometryEstimate Process(const GreyImage& image, double time_s,
                           const OdometrySensors& sensors = {});
  // The pose of the IMU relative to the camera (metres); forgets what was learned of an IMU, and
  // begins the motion anew, if there is one.
  void SetImu(const Rigid3& cam_from_imu);
  // From now on follows no point that the mask hides; begins the motion anew, if there is one.
  void SetMask(const ImageMask& mask);
  // The inverse depths of the points in the newest image whose depth is known to a third.
  std::vector<OdometryDepth> Depths() const;
  // From now on the focal length is `ratio` times the camera's; begins the motion anew.
  void ReplaceLens(double ratio);
  // Whether the depths contradict the images: then they are no longer used.
  bool RefusesDepth() const { return depth_.is_refused(); }
  // Whether the focal length of the lens changes from image to image.
  bool FollowsLens() const { return lens_.is_followed(); }
  const Gyroscope& gyroscope() const { return imu_.gyroscope(); }
  ImuCalibration imu() const { return imu_.Calibration(window_); }
  // The window as it was optimised last, for tools that measure the search; it has no motion yet
  // while the state is kPreliminary.
  const Window& window() const { return window_; }
  const WindowOptions& window_options() const { return window_options_; }

 private:
  struct KeptKeyframe {
    int id = 0;
    std::shared_ptr<const GreyPyramid> pyramid;
  };
  struct FollowedPoints {
    std::vector<size_t> indices;  // in the window
    std::vector<std::optional<Eigen::Vector2f>> places;

    double ShareLost() const;
  };
  struct Motion {
    double time_s = 0;
    Rigid3 cam_from_odom;
  };

  // odometry.cc: an image from its arrival to its pose.
  std::shared_ptr<const GreyPyramid> TrackedImage(const GreyImage& image);
  void BeginFirst(double time_s);
  void ProcessNext(double time_s, OdometryEstimate& estimate);
  Rigid3 Predict(double time_s, const std::optional<Turn>& measured) const;
  Eigen::Vector2d RayAt(const Eigen::Vector2f& px) const;
  bool IsHidden(const Eigen::Vector2f& px) const {
    return mask_.Hides((px.x() + 0.5) / camera_.width, (px.y() + 0.5) / camera_.height);
  }
  void EstimatePose(const Rigid3& predicted, OdometryEstimate& estimate);
  std::vector<PosePoint> NewestPoints(const Rigid3& pose) const;
  void UseFocalRatio(double ratio);
  bool WatchLens(std::span<const PosePoint> points, const PoseFitPrior& prior, const Rigid3& pose);
  double ShareThatFits(const Rigid3& cam_from_odom) const;
  void OptimizeWindow(std::span<const Rigid3> starts);
  void AddScaleDrift();
  bool LookForRival(double cost, OdometryEstimate& estimate);
  bool IsUncertain(double elapsed, double share_of_inliers);
  void LearnGyroscope(const OdometryEstimate& estimate);
  void TellMetre(OdometryEstimate& estimate) const;
  void BeginAnew();

  // odometry_following.cc: the points in the next image.
  std::optional<Eigen::Vector2f> PxOf(const Rigid3& cam_from_anchor,
                                      const WindowPoint& point) const;
  // Where the earliest keyframe whose image is kept saw a point; null if none did.
  const KeptKeyframe* EarliestView(const WindowPoint& point) const;
  FollowedPoints FollowFrom(const Rigid3& predicted) const;
  Rigid3 TurnedAsImage(const Rigid3& predicted) const;
  int Follow();
  Eigen::Matrix3d RotationOfFlow(const Rigid3& predicted) const;
  void FollowInertia(const Rigid3& predicted, OdometryEstimate& estimate);

  // odometry_beginning.cc: the first images, until the motion is decided.
  void AddFirstPoints();
  void EstimateBeginning(OdometryEstimate& estimate);
  void DropFirst();

  // odometry_keyframes.cc: the images that are kept, and their points.
  bool NeedsKeyframe(const OdometryEstimate& estimate) const;
  Eigen::Matrix2f StretchSince(int image, const WindowPoint& point) const;
  int FitPatches();
  void LearnTurns();
  void MakeKeyframe();
  void AddPoints();
  void Forget();

  OdometryOptions options_;
  WindowOptions window_options_;
  Rng rng_;

  int halvings_ = 0;  // of the camera's image, to the tracked one
  Camera camera_;     // of the tracked image; with the focal length of the newest one
  double focal_ = 1;  // fx without a change of the lens
  double max_lens_angle_ = 0;
  LensWatch lens_;
  ImageMask mask_;

  std::shared_ptr<const GreyPyramid> last_, present_;
  std::vector<std::shared_ptr<GreyPyramid>> pyramids_;  // all; reused when nobody else holds them
  std::vector<GreyBuffer> halved_;                      // of the image, down to the tracked one
  // The newest keyframes, whose patches are followed; by image.
  std::vector<KeptKeyframe> keyframes_;
  int keyframe_id_ = -1;
  bool keyframe_is_due_ = false;

  Window window_;
  InverseDepthSolver solver_;
  PoseCovariance covariance_ = PoseCovariance::Zero();
  double scale_variance_ = 0;  // of the logarithm, between the held images and the newest
  double scale_drift_ = 0;
  RivalWatch rival_watch_;

  bool is_beginning_ = true;
  std::optional<Window> leader_;  // of the beginning: with the motion that explains it best
  Rigid3 preliminary_;            // the pose of the newest image by `leader_`
  double compared_s_ = 0;         // when the rivals of `leader_` were last optimised

  int run_ = 0;
  std::vector<Motion> last_motions_;  // of the two newest images, as they were given
  double seen_s_ = 0;                 // time of the newest image whose points tell its pose
  double doubt_ = 0;                  // how many points did not fit in the last images
  bool is_uncertain_ = false;
  bool is_sure_ = false;  // the newest image fits well

  InertialSensor imu_;
  DepthSensor depth_;
};

}  // namespace oaslam
