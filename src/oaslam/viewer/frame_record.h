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

// One image and what the tracker made of it, as a run hands it to its viewers: shared content and a
// few numbers.
struct FrameRecord {
  FrameNote note;
  std::optional<Rigid3> world_from_cam;
  int keypoints = 0, matched = 0, objects = 0;
  double confidence = 0;  // [0, 1], that the pose is right
  double ms_features = 0, ms_track = 0, ms_objects = 0;
  FrameView view;
  cv::Mat image;           // 8-bit, as the camera gave it; not written later
  std::string image_path;  // of a file that may show it in colour; may be empty
  Orientation image_orientation = Orientation::kStored;  // as which that file is read
};

}  // namespace oaslam
