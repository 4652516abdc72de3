#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <vector>

#include "tracker.h"

// The calibration of images as the camera gives them. Throws std::runtime_error for a lens model
// other than plumb_bob and equidistant, and for binned images or parts of images.
Lens LensOf(const sensor_msgs::CameraInfo& info);

// The image, 8-bit grey, BGR or BGRA: a view of the message, but for rgb8, which is a copy. Throws
// std::runtime_error for another encoding.
cv::Mat ImageOf(const sensor_msgs::Image& message);

geometry_msgs::Pose PoseOf(const Eigen::Isometry3d& pose);
geometry_msgs::Transform TransformOf(const Eigen::Isometry3d& motion);
Eigen::Isometry3d MotionOf(const geometry_msgs::Transform& transform);

// An ellipsoid for each object, after a marker that removes those of before.
visualization_msgs::MarkerArray MarkersOf(const std::vector<MappedObject>& objects,
                                          const std_msgs::Header& header);
