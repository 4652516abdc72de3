#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "oaslam/objects/known_poses.h"
#include "object_film.h"

// A table with things on it, and what a detector sees of them from known poses.
namespace oaslam::object_table {

using synthetic::EmptyMap;
using synthetic::kCamera;
using synthetic::kUp;
using synthetic::TrueObject;

// A table with two cups side by side, a book and a bottle.
inline std::vector<TrueObject> TableTop() {
  const auto turned = [](double yaw) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  };
  return {{41, {{-0.1, 0, 0.05}, {0.05, 0.05, 0.06}, turned(0)}},
          {41, {{0.1, 0.05, 0.05}, {0.05, 0.05, 0.06}, turned(0)}},
          {73, {{0.3, -0.3, 0.02}, {0.15, 0.1, 0.03}, turned(0.7)}},
          {39, {{-0.3, 0.3, 0.12}, {0.04, 0.04, 0.12}, turned(0)}}};
}

inline Rigid3 LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, double roll = 0) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()));
  return Rigid3(turn, Eigen::Vector3d::Zero()) * synthetic::LookAt(eye, target);
}

struct Noise {
  double box_px = 1, miss_rate = 0.1, false_rate = 0.1;
};

inline std::vector<PosedDetections> Film(const std::vector<TrueObject>& objects, int frames,
                                         const Noise& noise, uint64_t seed) {
  Rng rng(seed);
  std::vector<PosedDetections> film;
  for (int i = 0; i < frames; ++i) {
    const double angle = 2.0 * i / frames;
    PosedDetections frame;
    frame.frame_index = i;
    frame.timestamp = i / 30.0;
    frame.cam_from_world =
        LookAt({1.4 * std::cos(angle), 1.4 * std::sin(angle), 0.7 + 0.1 * std::sin(7 * angle)},
               {0, 0, 0.05}, rng.Gaussian(0.03));
    for (const TrueObject& object : objects) {
      if (rng.Uniform(0, 1) < noise.miss_rate) continue;
      Box box = *ProjectToBox(object.ellipsoid, frame.cam_from_world, kCamera);
      for (double* edge : {&box.x1, &box.y1, &box.x2, &box.y2}) *edge += rng.Gaussian(noise.box_px);
      frame.detections.push_back({object.category_id, 0.8, box, 0});
    }
    if (rng.Uniform(0, 1) < noise.false_rate) {
      const double x = rng.Uniform(0, 560), y = rng.Uniform(0, 400);
      frame.detections.push_back({41, 0.6, {x, y, x + 60, y + 60}, 0});
    }
    frame.detections.push_back(
        {41, 0.4, {300, 20, 360, 80}, 0});  // below the least score for mapping
    film.push_back(std::move(frame));
  }
  return film;
}

inline std::vector<Object> MappedObjects(const Map& map) {
  std::vector<Object> mapped;
  map.objects.ForEach([&](ObjectId, const Object& o) {
    if (o.state == ObjectState::kMapped) mapped.push_back(o);
  });
  return mapped;
}

inline double DistanceToNearest(const TrueObject& truth, const std::vector<Object>& mapped) {
  double nearest = 1e9;
  for (const Object& o : mapped)
    if (o.category_id == truth.category_id)
      nearest = std::min(nearest, (o.ellipsoid.center - truth.ellipsoid.center).norm());
  return nearest;
}

}  // namespace oaslam::object_table
