#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

// An image, and what came with it.
struct ImageInput {
  // 8-bit, of the camera's size: grey, which is read where it is and not copied, BGR or BGRA. It
  // may be a view of other memory, and must not change until the call returns.
  cv::Mat image;
  double timestamp = 0;  // seconds, ascending
  // From an object detector, in pixels of this image; may be empty. Class, score and box are used;
  // an ellipse is not.
  std::vector<Detection> detections{};
  // The detections will be given later, by AddDetections.
  bool detections_follow = false;
  // Gravity in the camera's frame (OpenCV axes) where a sensor measures it, of any length. For an
  // accelerometer give the measured length: it shows how much the hand shook. Where keyframes have
  // gravity, the map's vertical is computed from it.
  std::optional<Eigen::Vector3d> gravity_in_cam{};
};

}  // namespace oaslam
