#pragma once

#include <span>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The least number of common landmarks by which a detection, or another object, is the same object:
// tau of the paper.
constexpr int kMinSharedPoints = 10;

// Adds votes for landmarks (ascending) to an object's.
void AddVotes(const std::vector<LandmarkId>& landmarks, const std::vector<uint16_t>& votes,
              Object& object);

// The landmarks that were inside the boxes of an object at least `votes` times, and more often than
// chance explains; ascending.
std::vector<LandmarkId> VotedLandmarks(const Object& object, int votes = 0);

// The landmarks that belong to an object, ascending: those that were inside its boxes at least a
// third as often as the most frequent one, and more often than chance explains.
std::vector<LandmarkId> OwnLandmarks(const Object& object);

// The number of landmarks that are in both; both are ascending.
int CountShared(std::span<const LandmarkId> a, std::span<const LandmarkId> b);

// Whether an unmapped object can be recognised by its landmarks when it is seen again: whether
// kMinSharedPoints landmarks of the map are its own. The paper's model recognises only
// objects with an ellipsoid.
bool IsKnownByLandmarks(const Map& map, const ObjectsConfig& config, const Object& object);

// Sets Object::known_by_landmarks. The ellipsoid of a tentative object becomes a sphere around its
// landmarks.
void RecognizeByLandmarks(const Map& map, const ObjectsConfig& config, Object& object);

}  // namespace oaslam
