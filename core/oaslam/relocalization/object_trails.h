#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/estimation/motion_filter.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/relocalization/object_scene.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Finds a camera by its detected objects over successive images. Each candidate pose is followed
// through the images: predicted with constant velocity, and refined by the boxes. A pose and its
// best rival are compared by their mean scores over the last images, since a wrong pose rarely
// explains the boxes of many images as well as those of one.
class ObjectTrails {
 public:
  // As RelocalizeByObjects, for an image with a time stamp (seconds) after that of the last call;
  // scores and margins are those of the trails, and the objects of the last second count as
  // matched for the acceptance. An image without detections of mapped classes changes nothing.
  std::vector<Relocalization> Follow(double timestamp, std::span<const ObjectDetection> detections,
                                     const Camera& camera, const Map& map,
                                     const RelocalizationConfig& config,
                                     const std::optional<Eigen::Vector3d>& gravity_in_cam,
                                     Rng& rng);

 private:
  // A pose that was followed up to the newest image.
  struct Trail {
    Relocalization newest;
    MotionFilter motion;
    // Sums of scores and of weights over its images; older images count less.
    double score = 0, weight = 1;
    std::map<ObjectId, double> matched_at;  // time stamp
  };

  static void GoOn(Trail& trail, const ObjectScene& scene, double seconds);
  void KeepDistinct(std::vector<Trail> trails, double timestamp);
  std::vector<Relocalization> NewestPoses() const;

  std::vector<Trail> trails_;  // by score, best first; distinct
  std::optional<double> timestamp_;
};

}  // namespace oaslam
