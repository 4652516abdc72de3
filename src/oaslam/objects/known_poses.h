#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The detections of an image whose pose is known.
struct PosedDetections {
  int frame_index = 0;
  double timestamp = 0;
  Rigid3 cam_from_world;
  std::vector<ObjectDetection> detections;
};

struct KnownPoseMap {
  Map map;  // a keyframe without features per frame
  double mean_iou =
      0;  // over mapped objects, of the mean over all of an object's untruncated observations
};

// Maps objects from known poses, which stay as they are. `progress` is called after each frame with
// their count.
KnownPoseMap MapObjectsFromKnownPoses(std::span<const PosedDetections> frames, const Camera& camera,
                                      const ObjectsConfig& config,
                                      const ClassRelations& classes = {},
                                      const std::function<void(int)>& progress = {});

}  // namespace oaslam
