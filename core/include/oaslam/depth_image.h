#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// How a depth camera measures.
struct DepthModel {
  // The standard deviation of a depth z, in metres: `floor` + `quadratic` * z^2. The default is
  // that of structured light and active stereo (Khoshelham and Elberink 2012).
  double floor = 0.002, quadratic = 0.002;
  // Metres; depths outside of this range are not used.
  double nearest = 0.15, farthest = 8;
};

// The image of a depth camera: the z of what each pixel shows, in the camera's frame:
//
//   DepthImage depth{.image = depth_mm, .unit = 0.001};
//   depth.camera = LoadCamera("depth.yaml");  // unless it is registered to the colour image
//   depth.cam_from_depth = cam_from_depth;
//   slam.Process({.image = image, .timestamp = timestamp, .depth = depth});
struct DepthImage {
  // 16 bit unsigned, of which each count is `unit` metres, or 32 bit float in metres. 0, negative
  // and not finite: not measured. As ImageInput::image, it is not copied.
  cv::Mat image;
  // Metres of a count, above 0 to 1.
  double unit = 0.001;
  // The camera of the depth image, which it fits in size; nothing: the depth is registered, so that
  // both images show the same view, which they may divide into other numbers of pixels.
  std::optional<Camera> camera{};
  // The pose of a depth camera that is not registered relative to the colour camera; they are at
  // most 1 m apart.
  Rigid3 cam_from_depth{};
  DepthModel model{};
};

}  // namespace oaslam
