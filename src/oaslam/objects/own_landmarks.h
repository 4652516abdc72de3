#pragma once

#include <span>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The landmarks that belong to an object, ascending: those that were inside its boxes at least a
// third as often as the most frequent one, and more often than chance explains.
std::vector<LandmarkId> OwnLandmarks(const Object& object);

// The number of landmarks that are in both; both are ascending.
int CountShared(std::span<const LandmarkId> a, std::span<const LandmarkId> b);

// Whether an object that is not mapped can be known by its landmarks when it is seen again: whether
// objects.min_shared_points landmarks of the map are its own. The paper's model knows only objects
// with an ellipsoid again.
bool IsKnownByLandmarks(const Map& map, const ObjectsConfig& config, const Object& object);

// Sets Object::known_by_landmarks. Of a tentative object its landmarks also tell where it is: its
// ellipsoid is a sphere about them.
void RecognizeByLandmarks(const Map& map, const ObjectsConfig& config, Object& object);

}  // namespace oaslam
