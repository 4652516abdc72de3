#pragma once

#include "oaslam/slam.h"
#include "oaslam/viewer/frame_record.h"

namespace oaslam {

// The newest image of a Slam, for viewers. `image`: as the camera gave it; it must not be modified
// later.
FrameRecord FrameRecordOf(const Slam& slam, const TrackingResult& result, const cv::Mat& image);

}  // namespace oaslam
