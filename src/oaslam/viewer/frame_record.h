#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "oaslam/images/image_files.h"
#include "oaslam/map/frame_view.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// One line of the page's timeline.
struct FrameNote {
  int frame = 0;
  double timestamp = 0;
  TrackingState state = TrackingState::kLost;
  int inliers = 0;
  double ms_total = 0;
};

// An image and its tracking result, as a run hands it to its viewers; large content is shared.
struct FrameRecord {
  FrameNote note;
  std::optional<Rigid3> world_from_cam;
  int keypoints = 0, matched = 0, objects = 0;
  double confidence = 0;  // [0, 1], that the pose is right
  double ms_features = 0, ms_track = 0, ms_objects = 0;
  FrameView view;
  cv::Mat image;           // 8-bit, as given by the camera; must not be modified later
  std::string image_path;  // file that may contain the image in colour; may be empty
  // The orientation in which that file is read.
  Orientation image_orientation = Orientation::kStored;
};

}  // namespace oaslam
