#pragma once

#include <cstdint>

namespace oaslam::python {

// The records of the arrays that Python gets; their fields are those of the public headers.
struct KeyframeRow {
  uint32_t id;
  int32_t frame;  // -1: of a file
  double timestamp;
  int32_t camera;
  double world_from_cam[4][4];
};
struct LandmarkRow {
  uint32_t id;
  double position[3];
  int32_t observations;
};
struct ObservationRow {
  uint32_t keyframe, landmark;
  int32_t keypoint;
  double pixel[2];
  double sigma_px;
};
struct SightingRow {
  int64_t keyframe;  // -1: another image
  int32_t frame;     // -1: of a file
  double world_from_cam[4][4];
  double box[4];  // x1, y1, x2, y2
  double score;
};
struct TrackedPointRow {
  double pixel[2];
  double sigma_px;
  int64_t landmark;  // -1: none
  double position[3];
};

}  // namespace oaslam::python
