#pragma once

#include <utility>
#include <vector>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/frame.h"
#include "oaslam/util/rng.h"
#include "synthetic_world.h"

// Simulated detections of ellipsoids in the synthetic world.
namespace oaslam::synthetic {

struct TrueObject {
  int category_id = 0;
  Ellipsoid ellipsoid;
};

inline Object MappedObject(const TrueObject& truth) {
  Object object;
  object.category_id = truth.category_id;
  object.state = ObjectState::kMapped;
  object.ellipsoid = truth.ellipsoid;
  return object;
}

// Its shape and place are known as after many observations.
inline Object WellMappedObject(const TrueObject& truth) {
  Object object = MappedObject(truth);
  object.covariance.diagonal() << 1e-4, 1e-4, 1e-4, 0.01, 0.01, 0.01, 0.1;
  return object;
}

// Its id is the number of objects before it.
inline void AddObject(Map& map, Object object) {
  map.objects.Insert(ObjectId(static_cast<uint32_t>(map.objects.size())), std::move(object));
}

inline std::vector<TrueObject> ObjectsOf(const Map& map) {
  std::vector<TrueObject> objects;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    objects.push_back({object.category_id, object.ellipsoid});
  });
  return objects;
}

struct DetectorOptions {
  double box_px = 1;  // noise of the edges
  double miss_rate = 0;
  // Least share of a box in the image for a detection; boxes are cut at the border.
  double min_inside = 0.3;
};

// Objects behind the camera or mostly out of the image are not detected; objects
// do not hide each other.
inline std::vector<ObjectDetection> Detect(const std::vector<TrueObject>& objects,
                                           const Rigid3& cam_from_world, const Camera& camera,
                                           const DetectorOptions& options, Rng& rng) {
  std::vector<ObjectDetection> detections;
  const Box bounds = IdealImageBounds(camera);
  for (const TrueObject& object : objects) {
    const bool is_missed = rng.Uniform(0, 1) < options.miss_rate;
    auto box = ProjectToBox(object.ellipsoid, cam_from_world, camera);
    if (is_missed || !box || ShareInside(*box, bounds) < options.min_inside) continue;
    for (double* edge : {&box->x1, &box->y1, &box->x2, &box->y2})
      *edge += rng.Gaussian(options.box_px);
    const Box cut = Intersection(*box, bounds);
    detections.push_back({object.category_id, 0.8, cut, TruncatedEdges(camera, cut)});
  }
  return detections;
}

inline TrueObject Upright(int category_id, const Eigen::Vector3d& center,
                          const Eigen::Vector3d& half_axes) {
  return {category_id, {center, half_axes, Eigen::Quaterniond::Identity()}};
}

// A camera on a circle around the origin, at this angle.
inline Rigid3 OnCircle(double angle_rad, double radius = 1.5, double height = 0.7) {
  return LookAt({radius * std::cos(angle_rad), radius * std::sin(angle_rad), height}, {0, 0, 0.05});
}

}  // namespace oaslam::synthetic
