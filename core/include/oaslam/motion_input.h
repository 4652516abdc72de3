#pragma once

#include <Eigen/Core>
#include <vector>

#include "oaslam/rigid3.h"

namespace oaslam {

// How the camera moved until an image, as an odometry outside of Slam tells it: that of a phone in
// its browser (docs/odometry-js.md), of ARKit or ARCore, or of a robot. Its frame and its unit are
// its own.
struct MotionInput {
  // Nothing is known where this is false: the rest is not read.
  bool is_known = true;
  // Counts the interruptions: nothing is known of how poses of different runs lie to each other.
  int run = 0;
  int image = 0;           // ascends in a run; it need not count each image
  Rigid3 odom_from_cam{};  // OpenCV axes
  // The odometry may still change its mind: only the rotation is used.
  bool is_preliminary = false;
  double agreeing = 1;  // share of the points followed that agree with the pose
  // Inverse depths of points in the image, in the odometry's unit. From those that the map knows,
  // too, the length of that unit in the map is learned: without any only the rotation is used.
  struct PointDepth {
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of the image as it was given
    double inverse_depth = 0;
  };
  std::vector<PointDepth> depths{};
  // Earlier images of this run whose poses the odometry has corrected, as it knows them by now; by
  // image, ascending.
  struct CorrectedPose {
    int image = 0;
    Rigid3 odom_from_cam;
  };
  std::vector<CorrectedPose> corrected{};
  bool is_keyframe = false;  // the view has changed
};

}  // namespace oaslam
