#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/class_names.h"
#include "oaslam/map/map.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// What is known of an image whose map is drawn into it.
struct ArFrame {
  Camera camera{};                         // of the picture; its distortion is ignored
  std::optional<Rigid3> cam_from_world{};  // nothing while the camera is lost
  const Map* map = nullptr;                // null while there is none
  std::string state{};                     // "tracking"...
  int objects = 0;                         // seen in this image
  double confidence = 0;                   // [0, 1], of the pose
};

// Draws into an ideal image of the camera (8-bit BGR): the path of the keyframes' cameras; the
// outlines of mapped objects with their names; each anchor as its three axes (x red, y green, z
// blue), as long as its content, with its name; and a line with the state, the objects seen and the
// confidence. Of names that would cover each other, that of the nearest thing is drawn.
void DrawArPicture(const ArFrame& frame, const ClassNames& names, cv::Mat& picture);
// Draws the boxes, in pixels of the picture, each in the colour of its class.
void DrawBoxes(const std::vector<Detection>& detections, cv::Mat& picture);

}  // namespace oaslam
