#pragma once

#include <optional>
#include <vector>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"

namespace oaslam {

// Estimates the similarity between the odometry's frame and the map's, from images of one run that
// were found in the map, mostly by objects. All these images together determine the pose of an
// image better than its own boxes do; they also determine the pose of an image that shows nothing
// of the map.
class OdometryRegistration {
 public:
  // Takes an image that was found in the map, unless the camera's motion is not known yet. `unit`:
  // length of the odometry's unit, map units; if it is absent, Add estimates it from the objects in
  // view.
  void Add(const Frame& frame, const Relocalization& in_map, const std::optional<double>& unit,
           const Map& map);
  struct Registered {
    ExpectedPose pose;
    double agreeing = 0;  // share of the images found that agree with the similarity
    double unit = 1;      // of the odometry, map units
  };
  // The pose of an image in the map; nothing where the images that were found do not agree with
  // each other, are not of the run of `frame`, or are too old.
  std::optional<Registered> PoseOf(const Frame& frame) const;

 private:
  struct Sight {
    double timestamp = 0;
    Rigid3 cam_from_odom;
    Rigid3 cam_from_map;
    double sigma = 0;  // of the position, map units
    std::optional<double> unit;
  };
  int run_ = 0;
  std::vector<Sight> sights_;  // the newest ones, ascending by time
};

}  // namespace oaslam
