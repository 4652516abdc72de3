#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/odometry/beginning.h"
#include "oaslam/odometry/corners.h"
#include "oaslam/odometry/grey_pyramid.h"
#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

struct OdometryOptions {
  int max_width = 960;     // of the tracked image: larger ones are halved until they fit
  int window = 10;         // free keyframes
  int recent = 2;          // free images that are no keyframes
  int max_beginning = 14;  // keyframes before the motion is known: then the first is dropped
  CornerGrid grid;
  BeginningOptions beginning;
};

enum class OdometryState {
  kPreliminary,  // by the motion that explains the images best so far
  kTracking,
  kBlind,  // the image has next to no texture: the pose is a guess, and to be given to nobody
};
const char* ToString(OdometryState state);

struct OdometryEstimate {
  OdometryState state = OdometryState::kPreliminary;
  Rigid3 cam_from_odom;
  // Of a PoseVector, from the window alone: it orders estimates by their risk, but says 1 or 2 %
  // where a wrong minimum is off by 15.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int tracked = 0;  // points followed into this image
  int inliers = 0;
  bool is_keyframe = false;
  bool was_restarted = false;  // the window was found to be in a wrong minimum, and changed
};

// Visual odometry of one camera: the pose of every image in a frame of its own, in the unit of the
// median depth at the beginning, without a map. Points are followed by their patches; a window of
// keyframes with inverse depths is optimised at each image.
class Odometry {
 public:
  Odometry(const Camera& camera, const OdometryOptions& options, uint64_t seed);

  // `image` has the camera's size; times ascend.
  OdometryEstimate Process(const GreyImage& image, double time_s);

 private:
  struct Motion {
    double time_s = 0;
    Rigid3 cam_from_odom;
  };

  GreyPyramid TrackedImage(const GreyImage& image) const;
  void BeginFirst(double time_s);
  Rigid3 Predict(double time_s) const;
  Eigen::Vector2d RayAt(const Eigen::Vector2f& px) const;
  std::optional<Eigen::Vector2f> PxOf(const Rigid3& cam_from_odom, const WindowPoint& point) const;
  int Follow(const Rigid3& predicted);
  Eigen::Matrix3d RotationOfFlow(const Rigid3& predicted) const;
  void EstimateBeginning(OdometryEstimate& estimate);
  void EstimatePose(const Rigid3& predicted, OdometryEstimate& estimate);
  bool NeedsKeyframe(const OdometryEstimate& estimate) const;
  void MakeKeyframe();
  void AddPoints();
  void Forget();

  Camera camera_;  // of the tracked image
  int halvings_ = 0;
  OdometryOptions options_;
  WindowOptions window_options_;
  Rng rng_;

  Window window_;
  bool is_beginning_ = true;
  bool keyframe_is_due_ = false;
  bool is_doubtful_ = false;  // points did not fit since the window was last looked through
  std::shared_ptr<const GreyPyramid> last_, keyframe_, present_;
  int keyframe_id_ = -1;
  std::vector<Motion> last_motions_;  // of the two newest images, as they were given
};

}  // namespace oaslam
