#pragma once

#include <string>
#include <vector>

#include "common.h"
#include "oaslam/detection_file.h"

namespace oaslam::apps {

// The detections of an image that is not available itself.
struct TimedDetections {
  int index = 0;         // in the order of names
  double timestamp = 0;  // seconds
  std::string name;
  std::vector<Detection> detections;
};

// Assigns times to the images of a detection file by their names: a number is a time stamp;
// otherwise image i is at i/fps (default 30). Ordered by time stamp or name, then cut to
// --from/--to. Throws InputError when nothing remains.
std::vector<TimedDetections> SelectTimedDetections(const DetectionTable& table,
                                                   const std::string& path,
                                                   const CommonOptions& options);

}  // namespace oaslam::apps
