#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "oaslam/map_localizer.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/oaslam_c.h"
#include "oaslam/slam.h"

// What the handles of the interface for C stand for.

struct oaslam_slam {
  oaslam::Slam slam;
};
struct oaslam_localizer {
  oaslam::MapLocalizer localizer;
};
struct oaslam_map {
  explicit oaslam_map(oaslam::MapSnapshot content) : map(std::move(content)) {}

  oaslam::MapSnapshot map;
  // Arrays are made when they are first asked for, by whichever thread.
  std::once_flag has_objects, has_anchors, has_landmarks, has_keyframes, has_trajectory,
      has_class_names, has_bytes;
  std::vector<oaslam::MapSnapshot::Object> named_objects;
  std::vector<oaslam::AnchorPose> named_anchors;
  std::vector<oaslam_object> objects;
  std::vector<oaslam_anchor> anchors;
  std::vector<oaslam_landmark> landmarks;
  std::vector<oaslam_keyframe> keyframes;
  std::vector<oaslam_stamped_pose> trajectory;
  std::vector<oaslam_class_name> class_names;
  std::string bytes;
};
