#pragma once

#include <set>
#include <span>

#include "oaslam/config.h"
#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Merges each of `changed` with objects of its class that are the same: their boxes in space
// overlap, one's centre is in the other, or they share landmarks (paper, section "Objects Fusion");
// and one ellipsoid explains the observations of both. Two objects that were detected side by side
// in the same images are never one. The merged observations go to the older object; the other's id
// stays resolvable.
void MergeDuplicates(Map& map, const std::set<ObjectId>& changed, const ObjectsConfig& config);

// The same for two objects that a user knows to be one: of one class, and with a common ellipsoid
// at all. False, and nothing changed, otherwise.
bool MergeObjects(Map& map, ObjectId kept, ObjectId gone, const ObjectsConfig& config);

// A model, and all that follows from it, into the object.
struct ObjectModel;
void AdoptModel(const ObjectModel& model, std::span<const BoxView> views, Object& object);

// Adds votes for landmarks (ascending) to an object's.
void AddVotes(const std::vector<LandmarkId>& landmarks, const std::vector<uint16_t>& votes,
              Object& object);

}  // namespace oaslam
