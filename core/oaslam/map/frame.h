#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/features/depth_map.h"
#include "oaslam/features/features.h"
#include "oaslam/features/grey_image.h"
#include "oaslam/ids.h"
#include "oaslam/map/label_shares.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// What tells the length of a metre where the user does not: the usual sizes of the map's objects,
// an IMU, or a depth camera.
enum class UnitSource { kObjects, kImu, kDepth };

// A detection converted to the ideal image of its camera.
struct ObjectDetection {
  int category_id = 0;
  double score = 0;
  Box box;                      // ideal (undistorted) image
  unsigned char truncated = 0;  // EdgeBits of edges at the border of the original image
  LabelShares shares{};
  // The z of the surface that the box shows, by a depth camera, in units of the map in which the
  // frame is searched; 0: not known.
  double surface = 0;
};

// Converts detections to the ideal image of the camera, in the same order; a box is empty where the
// lens model is not invertible.
std::vector<ObjectDetection> IdealDetections(const Camera& camera,
                                             const std::vector<Detection>& detections);

// The length of a unit in metres, by an IMU or a depth camera.
struct MeasuredMetre {
  double metres_per_unit = 1;
  double relative_sigma = 0;  // standard deviation
  UnitSource source = UnitSource::kImu;
};

// The result of the visual odometry (odometry/) for an image: its pose in the odometry's own frame,
// and the inverse depths of its points.
struct FrameMotion {
  // The inverse depth of a point in this image.
  struct KnownDepth {
    Eigen::Vector2f px;  // ideal image
    float inverse_depth = 0;
  };

  int run = 0;  // poses of different runs have no common frame
  int image = 0;
  Rigid3 cam_from_odom;
  bool is_preliminary = false;
  // The accumulated variance of the logarithm of the odometry's scale; the difference of two images
  // of a run is the variance between them. Nothing where it is not given.
  std::optional<double> scale_drift{};
  double agreeing = 1;  // share of the points followed that agree with the pose
  // cam_from_odom of the odometry's keyframes as estimated with this image, by image, ascending;
  // none while the motion is preliminary.
  std::vector<std::pair<int, Rigid3>> keyframes{};
  // The number of the image since which the odometry's earlier motion was wrong, if the odometry
  // found this with the present image.
  std::optional<int> exchanged_since{};
  bool is_keyframe = false;  // of the odometry: the view has changed
  std::vector<KnownDepth> depths;
  std::optional<MeasuredMetre> metre{};             // of the odometry's unit
  std::optional<Eigen::Vector3d> gravity_in_cam{};  // m/s^2, by an accelerometer
};

// The features and detections of an image, and its motion; immutable. Its pose is not part of it.
struct Frame {
  int index = 0;
  double timestamp = 0;
  std::shared_ptr<const Camera> camera;
  std::shared_ptr<const Features> features;
  std::vector<ObjectDetection> detections;
  // The detections will be given later (Tracker::AddDetections).
  bool detections_follow = false;
  std::optional<Eigen::Vector3d> gravity_in_cam{};  // measured, any length
  std::shared_ptr<const FrameMotion> motion{};      // null where it is not known
  std::shared_ptr<const DepthMap> depth{};          // measured; null: none
  // At the resolution of the features, for learned descriptors; null: there will be none.
  std::shared_ptr<const GreyBuffer> image{};
  // No features were extracted: the pose is to be by dead reckoning.
  bool features_skipped = false;
};

// Whether it is known how the camera moved between two images.
bool HaveKnownMotion(const std::shared_ptr<const FrameMotion>& a,
                     const std::shared_ptr<const FrameMotion>& b);
// cam_from_odom of an earlier image of the same run, by the odometry's estimates with image `now`.
// The odometry corrects its keyframes; an image that is no keyframe moves with the last keyframe
// before it that the motions of both images list. Nothing where there is no such keyframe: then the
// odometry has not corrected the pose of the earlier image.
std::optional<Rigid3> CamFromOdom(const FrameMotion& earlier, const FrameMotion& now);

// The pose of a frame in the map that the tracker saw, with the landmarks that support it.
struct PoseByLandmarks {
  Rigid3 cam_from_world;
  // The keyframe that shares most landmarks with the frame.
  KeyframeId reference{};
  std::vector<LandmarkId> landmarks{};  // by key point: inliers only, else invalid
  int inliers = 0;
  // Of the pose, given the landmarks (PoseReport).
  PoseCovariance covariance = PoseCovariance::Zero();
};

// A frame with its pose. The pose relative to the keyframe moves with later optimisation.
struct TrackedFrame : PoseByLandmarks {
  Frame frame;
  Rigid3 cam_from_reference;

  // Multiplies the lengths of this frame by `factor`, after those of the map were.
  void ScaleLengths(double factor);
};

}  // namespace oaslam
