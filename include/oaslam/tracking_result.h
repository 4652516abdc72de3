#pragma once

#include <optional>

#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// The tracking result of one image. Poses are camera-to-world, OpenCV axes (x right, y down, z
// forward), in the frame and unit of the map.
struct TrackingResult {
  int frame = 0;  // counted from 0 since the start, Load or Reset; -1: no image yet
  double timestamp = 0;
  TrackingState state = TrackingState::kLost;
  std::optional<Rigid3> world_from_cam;
  // `matched`: landmarks found; `inliers`: those that agree with the pose.
  int keypoints = 0, matched = 0, inliers = 0;
  // `detections`: all of this image; `objects`: mapped objects seen in it.
  int detections = 0, objects = 0;
  double confidence = 0;  // probability that the pose is right (RelocalizationResult)
  // Of the pose, in the frame of the map; 0 without a pose. What a loop will correct is in it only
  // as far as such errors are usual (docs/lab/uncertainty.md).
  PoseCovariance covariance = PoseCovariance::Zero();
  // The pose may be off by far more than the covariance says: it is preliminary, its confidence is
  // below .9, its sigma a tenth of the depth, or the map may have changed its scale since it was
  // begun, in a doorway or a swing. It ends where the camera sees again what it saw before.
  bool is_uncertain = false;
  // While the camera's motion carries the pose on (kOdometry): seconds since the map gave it; else
  // 0.
  double seconds_without_map = 0;
  // Median depth of the landmarks that support the pose, map units; 0 without any.
  double depth = 0;
  // The number of the piece of map that the pose refers to, counted from 0 since the start, Load or
  // Reset. A lost camera that is not found in its map begins a new piece. Poses in different pieces
  // have different frames and units. Earlier pieces are kept, and joined once they are seen again.
  // It is not the number of a piece in a file.
  int piece = 0;
  double ms_total = 0, ms_features = 0, ms_track = 0, ms_objects = 0;
  double cpu_ms = 0;  // CPU time from image in to pose out; mapping not counted
};

}  // namespace oaslam
