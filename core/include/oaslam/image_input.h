#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "oaslam/angular_velocity.h"
#include "oaslam/depth_image.h"
#include "oaslam/image_features.h"
#include "oaslam/imu.h"
#include "oaslam/motion_input.h"
#include "oaslam/types.h"

namespace oaslam {

// An image, and the measurements that belong to it:
//
//   ImageInput input{.image = image, .timestamp = timestamp};
//   input.detections = detector->Detect(image);
//   input.imu = samples;                          // since the image before
//   input.depth = DepthImage{.image = depth_mm};  // of a depth camera, registered
//   const TrackingResult result = slam.Process(input);
struct ImageInput {
  // 8-bit grey, BGR or BGRA, of the camera's size. A grey image is not copied: it may be a view of
  // other memory, which must not change until the call returns.
  cv::Mat image;
  double timestamp = 0;  // seconds, ascending
  // From an object detector, in pixels of this image; may be empty. Class, score and box are used;
  // an ellipse is not.
  std::vector<Detection> detections{};
  // The detections will be given later, by AddDetections.
  bool detections_follow = false;
  // Direction of gravity in the camera's frame (OpenCV axes), where a sensor measures it. Give an
  // accelerometer's vector with its measured length, which shows how much the hand shook; other
  // vectors may have any length. The map's vertical is computed from the gravity of its keyframes.
  std::optional<Eigen::Vector3d> gravity_in_cam{};
  // From a gyroscope, ascending in time (in Python rows of timestamp, x, y, z): all samples since
  // those of the image before. Samples that were given before are ignored; one that is more than 1
  // s later than the image throws InputError. Only Slam::Process uses them. Slam estimates the
  // bias, and the offset of the gyroscope's clock to that of the images, up to 0.25 s. If the
  // gyroscope's clock is ahead, the samples taken with an image have later time stamps than the
  // image; they help, but the caller need not wait for them. A turn in which samples are missing
  // for more than 0.1 s is not used.
  std::vector<AngularVelocity> angular_velocity{};
  // From an IMU, instead of angular_velocity, and with the same rules; gravity is measured, too.
  // The accelerations tell the length of a metre (Slam::Imu), as soon as the camera's motion
  // determines it: the map is in metres from then on, with the standard deviation
  // MapSnapshot::unit_sigma. The IMU tracks the camera while images show nothing.
  std::vector<ImuSample> imu{};
  // From a depth camera at the same time. The camera's motion is in metres from the first image
  // with depths on; depths that contradict the images are not used any more, with a warning. Throws
  // InputError for a type, shape or size that DepthImage does not allow. Relocalize checks and
  // refines poses of a known camera by it, in a map whose metre a user or a sensor told.
  std::optional<DepthImage> depth{};
  // The camera's motion by another odometry. Slam's own odometry then does not run on this image,
  // so that images may be a second apart. Only Slam::Process uses it. Throws InputError for poses
  // that are not valid, depths that are not finite, and numbers of corrected images that do not
  // ascend. Ignores inverse depths that are not positive.
  std::optional<MotionInput> motion{};
  // The key points of the image, which Slam uses where `image` is empty. Learned descriptors need
  // the image.
  std::optional<ImageFeatures> features{};
};

}  // namespace oaslam
