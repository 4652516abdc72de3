#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "oaslam/images/image_files.h"
#include "oaslam/map/frame_view.h"
#include "oaslam/tracking_result.h"

namespace oaslam {

class Slam;

// One line of the page's timeline.
struct FrameNote {
  int frame = 0;
  double timestamp = 0;
  TrackingState state = TrackingState::kLost;
  int inliers = 0;
  double ms_total = 0;
  bool is_uncertain = false;  // TrackingResult
};

// An image and its tracking result, as a run hands it to its viewers; large content is shared.
struct FrameRecord {
  TrackingResult result;
  FrameView view{};
  cv::Mat image{};           // 8-bit, as given by the camera; must not be modified later
  std::string image_path{};  // file that may contain the image in colour; may be empty
  // The orientation in which that file is read.
  Orientation image_orientation = Orientation::kStored;
};

// The newest image of a Slam, as it is shown; the caller adds the image.
FrameRecord RecordOf(const Slam& slam, const TrackingResult& result);

}  // namespace oaslam
