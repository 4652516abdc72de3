#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/estimation/object_score.h"
#include "oaslam/geometry/ideal_image.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"

namespace oaslam {

// A mapped object, prepared for many projections.
struct SceneObject {
  ObjectId id;
  int category_id = 0;
  Ellipsoid ellipsoid;
  Eigen::Matrix3d scaled_axes;  // world
  double radius = 0;            // of the sphere of its volume
  double reach = 0;             // its longest half axis
  double variance = 0;          // of its outline, map units^2, the same in all directions
  ShapeCovariance covariance;
  double detection_rate = 0;    // while it was mapped
  std::vector<int> detections;  // of its class, indices into ObjectScene::detections
};

struct SceneDetection {
  int index = 0;  // in the caller's list
  Box box;
  unsigned char truncated = 0;
  Eigen::Vector3d ray;       // through its centre, z = 1
  double size = 0;           // px
  std::vector<int> objects;  // of its class, indices into ObjectScene::objects
};

// How the mapping cameras were held, from which a query's pose is guessed.
struct CameraHabit {
  double min_pitch = 0, max_pitch = 0;  // rad, downwards, of the optical axis
  double mean_roll = 0;
};

// What a query image and the map say, arranged for scoring poses.
struct ObjectScene {
  Camera camera;
  ObjectScore score;
  IdealImage image;
  std::vector<SceneObject> objects;        // mapped ones
  std::vector<SceneDetection> detections;  // whose class is in the map, best detector scores first
  std::vector<Box> moving;                 // detections of classes that move: may hide any object
  ClassRelations classes;
  std::optional<Eigen::Vector3d> up;         // world
  std::optional<Eigen::Vector3d> up_in_cam;  // from a gravity sensor; only with `up`
  CameraHabit habit;                         // only with `up`

  ObjectScene(std::span<const ObjectDetection> all_detections, const Camera& query_camera,
              const Map& map, const RelocalizationConfig& config,
              const std::optional<Eigen::Vector3d>& gravity_in_cam);

  // Sum over the detections of their best score among the objects of `scope` (indices): fast, not
  // one to one, a common edge variance.
  double ScorePose(const Rigid3& cam_from_world, std::span<const int> scope) const;

  // One is a part of the other.
  bool AreTogether(int object_a, int object_b) const;

  // Whether the camera is held as gravity says, or as people do.
  bool IsPlausiblyHeld(const Eigen::Matrix3d& cam_from_world) const;
};

// The vertical seen by a camera of given pitch and roll.
Eigen::Vector3d UpInCamera(double pitch, double roll);

}  // namespace oaslam
