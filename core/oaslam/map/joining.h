#pragma once

#include <optional>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Transforms an object's ellipsoid and covariance.
void MoveObject(const Similarity& new_from_old, Object& object);

// The index of each camera in `table`, which gets those that it lacks.
std::vector<int> CameraNumbers(const std::vector<Camera>& cameras, std::vector<Camera>& table);
// Numbers the cameras of a map as they are in `table`, which gets those that it lacks.
void NumberCameras(std::vector<Camera>& table, Map& map);

// Adds the content of another map, which has no id of this one. Nothing is
// merged: landmarks and objects that both maps contain exist twice afterwards. An anchor whose name
// is taken gets a number.
void JoinMap(const Map& joined, const Similarity& world_from_other, Map& map);

// The unit of a map, from another map that is in metres.
struct Metre {
  double metres_per_unit = 1;
  std::optional<UnitEvidence> by_objects;  // its evidence; nothing where the user gave it
};
// The unit of `map`, from `other`, with which it is joined; nothing where `other` is not in metres,
// or `map` already is.
std::optional<Metre> MetreBy(const Map& other, const Similarity& world_from_other, const Map& map);

}  // namespace oaslam
