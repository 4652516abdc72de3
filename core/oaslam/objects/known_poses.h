#pragma once

#include <functional>
#include <span>
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
  Map map;  // with a keyframe without features for each frame
  // Mean over the mapped objects of their mean overlap with all their untruncated observations.
  double mean_iou = 0;
};

// Maps objects from images whose poses are known and stay fixed. `progress` is called after each
// frame with the number of frames so far.
KnownPoseMap MapObjectsFromKnownPoses(std::span<const PosedDetections> frames, const Camera& camera,
                                      const ObjectsConfig& config,
                                      const ClassRelations& classes = {},
                                      const std::function<void(int)>& progress = {});

}  // namespace oaslam
