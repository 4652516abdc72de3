#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// Where an object is that has a model, or that is known by its landmarks.
struct ObjectPlace {
  ObjectId id;
  bool is_mapped = false, is_tentative = false;
  bool is_known_by_landmarks = false;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // world
  double radius = 0;                                 // largest half axis
};

// The places of a map's objects, ascending by id. They are contiguous, so that a search for
// neighbours costs some nanoseconds for each object of a large map.
std::vector<ObjectPlace> PlacesOf(const Table<ObjectId, Object>& objects);

// The places of a map's objects, kept up to date with the snapshots of the map.
class ObjectPlaces {
 public:
  // Looks only at objects that may have changed since the last call. Keeps a copy of the table.
  void Update(const Table<ObjectId, Object>& objects);

  std::span<const ObjectPlace> all() const { return places_; }  // ascending by id

 private:
  Table<ObjectId, Object> known_;
  std::vector<ObjectPlace> places_;
};

}  // namespace oaslam
