#pragma once

#include <Eigen/Core>
#include <vector>

#include "oaslam/rigid3.h"

namespace oaslam {

// The motion of the camera up to an image by an odometry outside of Slam: one in a phone's browser
// (docs/odometry-js.md), ARKit, ARCore, or that of a robot. The odometry has its own frame and its
// own unit of length:
//
//   MotionInput motion{.image = number, .odom_from_cam = odom_from_cam};
//   motion.depths.push_back({pixel, 1 / depth});
//   slam.Process({.image = image, .timestamp = timestamp, .motion = motion});
struct MotionInput {
  // Whether the motion is known; if not, Slam ignores all other members.
  bool is_known = true;
  // Counts the interruptions of the odometry: the transformation between poses of different runs is
  // unknown.
  int run = 0;
  int image = 0;           // ascends in a run; it need not count each image
  Rigid3 odom_from_cam{};  // OpenCV axes
  // The odometry may still replace this motion by another one: Slam uses only the rotation.
  bool is_preliminary = false;
  double agreeing = 1;  // share of the points followed that agree with the pose
  // Inverse depths of points in the image, in the odometry's unit. Slam estimates the length of
  // that unit in the map from the points that are also landmarks of the map; without such points it
  // uses only the rotation.
  struct PointDepth {
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of the image as it was given
    double inverse_depth = 0;
  };
  std::vector<PointDepth> depths{};
  // Earlier images of this run whose poses the odometry has corrected, with their new poses;
  // ascending by image.
  struct CorrectedPose {
    int image = 0;
    Rigid3 odom_from_cam;
  };
  std::vector<CorrectedPose> corrected{};
  bool is_keyframe = false;  // the view has changed
};

}  // namespace oaslam
