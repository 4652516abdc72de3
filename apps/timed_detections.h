#pragma once

#include <string>
#include <vector>

#include "common.h"
#include "oaslam/camera.h"
#include "oaslam/formats/detection_file.h"
#include "oaslam/map/frame.h"

namespace oaslam::apps {

// The detections of one image that is itself not at hand.
struct TimedDetections {
  int index = 0;         // in the order of names
  double timestamp = 0;  // seconds
  std::string name;
  std::vector<Detection> detections;
};

// Images of a detection file by their names: a name that is a number is a time stamp, of others
// image i is at i/fps (30). Ordered by time stamp or name, then cut to --from/--to. Throws
// InputError when nothing remains.
std::vector<TimedDetections> SelectTimedDetections(const DetectionTable& table,
                                                   const std::string& path,
                                                   const CommonOptions& options);

// Into the ideal image of the camera.
std::vector<ObjectDetection> IdealDetections(const Camera& camera,
                                             const std::vector<Detection>& detections);

}  // namespace oaslam::apps
