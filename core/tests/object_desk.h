// A desk with objects, and the boxes that a detector finds there.

#pragma once

#include <numbers>
#include <utility>
#include <vector>

#include "object_table.h"

namespace oaslam::object_desk {

using object_table::kCamera;
using object_table::kUp;
using object_table::LookAt;

// Objects of few classes scattered over a desk of 1.6 m x 1.2 m, mapped from one side.
inline Map Desk(uint64_t seed, int objects = 14) {
  Rng rng(seed);
  Map map = object_table::EmptyMap();
  map.up = kUp;
  for (uint32_t k = 0; k < 10; ++k) {
    Keyframe keyframe;
    keyframe.cam_from_world =
        LookAt({1.6 * std::cos(0.1 * k), 1.6 * std::sin(0.1 * k), 0.8 + 0.03 * k}, {0, 0, 0});
    map.keyframes.Insert(KeyframeId(k), keyframe);
  }
  for (int i = 0; i < objects; ++i) {
    const double size = 0.05 + 0.02 * (i % 6);
    const synthetic::TrueObject object{
        i % 6,
        {{rng.Uniform(-0.8, 0.8), rng.Uniform(-0.6, 0.6), size},
         {size, size * rng.Uniform(0.7, 1), size},
         Eigen::Quaterniond(Eigen::AngleAxisd(rng.Uniform(0, 3), Eigen::Vector3d::UnitZ()))}};
    synthetic::AddObject(map, WellMappedObject(object));
  }
  return map;
}

// The mapped objects with their places exchanged.
inline Map Permuted(const Map& map, uint64_t seed) {
  Rng rng(seed);
  Map permuted = map;
  std::vector<ObjectId> ids;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state == ObjectState::kMapped) ids.push_back(id);
  });
  for (size_t i = ids.size() - 1; i > 0; --i)
    std::swap(permuted.objects.MutableAt(ids[i]).ellipsoid.center,
              permuted.objects.MutableAt(ids[rng.Index(static_cast<int>(i) + 1)]).ellipsoid.center);
  return permuted;
}

// The boxes of the objects in the image of a camera, each missed at the given rate, and a false
// one.
inline std::vector<ObjectDetection> Detect(const Map& map, const Rigid3& cam_from_world, Rng& rng,
                                           double miss_rate) {
  std::vector<ObjectDetection> detections;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (rng.Uniform(0, 1) < miss_rate) return;
    auto box = ProjectToBox(object.ellipsoid, cam_from_world, kCamera);
    if (!box) return;
    for (double* edge : {&box->x1, &box->y1, &box->x2, &box->y2}) *edge += rng.Gaussian(2);
    const Box cut = Intersection(*box, {0, 0, 640, 480});
    if (cut.Area() < 0.3 * box->Area()) return;
    detections.push_back({object.category_id, 0.8, cut, TruncatedEdges(kCamera, cut)});
  });
  detections.push_back({rng.Index(6), 0.5, {50, 50, 110, 130}, 0});
  return detections;
}

struct Query {
  Rigid3 cam_from_world;
  std::vector<ObjectDetection> detections;
};

// An image from a random place around. `roll`: the rotation of the camera about its optical axis,
// in addition to the trembling of the hand.
inline Query Photograph(const Map& map, Rng& rng, double miss_rate = 0.15, double roll = 0) {
  const double angle = rng.Uniform(0, 2 * std::numbers::pi), distance = rng.Uniform(1.2, 2.2);
  const Rigid3 pose =
      LookAt({distance * std::cos(angle), distance * std::sin(angle), rng.Uniform(0.6, 1.1)},
             {rng.Uniform(-0.2, 0.2), rng.Uniform(-0.2, 0.2), 0}, roll + rng.Gaussian(0.04));
  return {pose, Detect(map, pose, rng, miss_rate)};
}

}  // namespace oaslam::object_desk
