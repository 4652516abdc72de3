#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/features/features.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"
#include "oaslam/util/ids.h"

namespace oaslam {

// A detection brought into the ideal image of its camera.
struct ObjectDetection {
  int category_id = 0;
  double score = 0;
  Box box;                      // ideal (undistorted) image
  unsigned char truncated = 0;  // EdgeBits of edges at the border of the original image
};

// What is known of an image before its pose; immutable.
struct Frame {
  int index = 0;
  double timestamp = 0;
  int camera = 0;  // index into Map::cameras
  std::shared_ptr<const Features> features;
  std::vector<ObjectDetection> detections;
  bool detections_follow =
      false;  // a detector of its own pace gives them later (Tracker::AddDetections)
  std::optional<Eigen::Vector3d> gravity_in_cam{};  // measured, any length
};

// A frame with its pose and the landmarks its key points are matched to.
struct TrackedFrame {
  Frame frame;
  Rigid3 cam_from_world;  // in the map the tracker saw
  KeyframeId reference;   // keyframe that carries the pose through later optimisation
  Rigid3 cam_from_reference;
  std::vector<LandmarkId> landmarks;  // per key point; invalid where unmatched
  int inliers = 0;
};

}  // namespace oaslam
