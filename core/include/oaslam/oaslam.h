#pragma once

// Everything that applications use, in the order in which they meet it. docs/tour.md shows each in
// use.

// clang-format off
// Images and cameras
#include "oaslam/image_source.h"
#include "oaslam/latest_image.h"
#include "oaslam/camera.h"
#include "oaslam/camera_file.h"
#include "oaslam/camera_estimation.h"
// Detections of objects
#include "oaslam/detector.h"
#include "oaslam/background_detector.h"
#include "oaslam/detection_file.h"
#include "oaslam/class_names.h"
#include "oaslam/class_relations.h"
// Tracking and mapping
#include "oaslam/config.h"
#include "oaslam/config_file.h"
#include "oaslam/slam.h"
#include "oaslam/image_input.h"
#include "oaslam/imu.h"
#include "oaslam/angular_velocity.h"
#include "oaslam/motion_input.h"
#include "oaslam/image_features.h"
#include "oaslam/tracking_result.h"
#include "oaslam/slam_state.h"
#include "oaslam/anchors.h"
// The map as data, and images found in it
#include "oaslam/map_snapshot.h"
#include "oaslam/scale_estimate.h"
#include "oaslam/map_editing.h"
#include "oaslam/object_edit.h"
#include "oaslam/export_map.h"
#include "oaslam/map_localizer.h"
#include "oaslam/relocalization_result.h"
#include "oaslam/trajectory_file.h"
// To watch it at work; the viewer is a library of its own (oaslam/map_viewer.h)
#include "oaslam/log.h"
// What all of these share
#include "oaslam/error.h"
#include "oaslam/fork.h"
#include "oaslam/ids.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"
// clang-format on
