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

// A detection that may show an object, by their labels.
struct LabelMatch {
  int detection = 0;         // index into ObjectScene::detections
  double log_agreement = 0;  // ln of how well their labels agree (label_shares.h)
};

// A mapped object with precomputed values for many projections.
struct SceneObject {
  ObjectId id;
  int category_id = 0;
  Ellipsoid ellipsoid;
  Eigen::Matrix3d scaled_axes;  // world
  double radius = 0;            // of the sphere of the same volume
  double reach = 0;             // its longest half axis
  double variance = 0;          // of its outline, map units^2, the same in all directions
  const ShapeCovariance* covariance = nullptr;  // of the map
  double detection_rate = 0;                    // share of views that detected it during mapping
  std::span<const LabelMatch> detections{};     // those that may show it
};

struct SceneDetection {
  int index = 0;  // in the caller's list
  Box box;
  unsigned char truncated = 0;
  Eigen::Vector3d ray;          // through the centre of the box, z = 1
  double size = 0;              // px
  double depth_per_radius = 0;  // of an object that the box shows
  double surface = 0;           // its z, map units, by a depth camera; 0: not known
  std::vector<int> objects{};   // those that it may show, indices into ObjectScene::objects
};

// The range of camera orientations during mapping, from which poses of a query are guessed.
struct CameraAttitudes {
  double min_pitch = 0, max_pitch = 0;  // rad, downwards, of the optical axis against the horizon
  double mean_roll = 0;
};

// The detections of a query image and the objects of the map, arranged for scoring poses. Refers to
// the map, and is not copied, since the objects refer to lists of it.
struct ObjectScene {
  Camera camera;
  ObjectScore score;
  IdealImage image;
  std::vector<SceneObject> objects;      // those in state kMapped
  std::vector<Eigen::Vector4d> spheres;  // their centres and reaches, side by side in memory
  // Detections that may show an object of the map, best detector score first.
  std::vector<SceneDetection> detections;
  // Boxes of classes that move: they may hide any object.
  std::vector<Box> moving;
  ClassRelations classes;
  std::optional<Eigen::Vector3d> up;         // world
  std::optional<Eigen::Vector3d> up_in_cam;  // from a gravity sensor; only with `up`
  CameraAttitudes attitudes;                 // only with `up`

  ObjectScene(std::span<const ObjectDetection> all_detections, const Camera& query_camera,
              const Map& map, const RelocalizationConfig& config,
              const std::optional<Eigen::Vector3d>& gravity_in_cam);
  ObjectScene(const ObjectScene&) = delete;
  ObjectScene& operator=(const ObjectScene&) = delete;

  // A fast score of a pose: the sum over the detections of their best score among the objects of
  // `scope` (indices). The assignment is not one to one, and all edges have a common variance.
  double ScorePose(const Rigid3& cam_from_world, std::span<const int> scope) const;

  // Whether one object is a part of the other.
  bool AreTogether(int object_a, int object_b) const;

  // Whether the orientation agrees with the measured gravity, or else with how people hold cameras.
  bool IsPlausiblyHeld(const Eigen::Matrix3d& cam_from_world) const;

 private:
  std::vector<LabelMatch> label_matches_;  // by object
};

// Returns false only where an object whose longest half axis is `reach` cannot project into the
// box. A cheap test before the exact projection.
bool MayOverlap(const Box& box, const Camera& camera, const Eigen::Vector3d& center_in_cam,
                double reach);

// The vertical in the frame of a camera of given pitch and roll.
Eigen::Vector3d UpInCamera(double pitch, double roll);

}  // namespace oaslam
