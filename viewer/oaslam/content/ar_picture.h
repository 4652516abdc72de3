#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "oaslam/camera.h"
#include "oaslam/class_names.h"
#include "oaslam/content/model_library.h"
#include "oaslam/map/map.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// The content of an image of augmented reality.
struct ArFrame {
  Camera camera{};                         // of the picture; its distortion is ignored
  std::optional<Rigid3> cam_from_world{};  // nothing while the camera is lost
  const Map* map = nullptr;                // null while there is none
  std::string state{};                     // "tracking"...
  int objects = 0;                         // seen in this image
  double confidence = 0;                   // [0, 1], of the pose
};

// Draws into an ideal image of the camera (8-bit BGR): the outlines of mapped objects with their
// names; the content of the map's anchors with a shadow, hidden where a mapped ellipsoid is in
// front of it; and a line with the state. Content is lit from above and ahead, independent of the
// light of the scene.
void DrawArPicture(const ArFrame& frame, const ModelLibrary& models, const ClassNames& names,
                   cv::Mat& picture);

// Draws the content only.
void DrawContent(const ArFrame& frame, const ModelLibrary& models, cv::Mat& picture);

}  // namespace oaslam
