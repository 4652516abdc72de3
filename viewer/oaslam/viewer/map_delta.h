#pragma once

#include "oaslam/class_names.h"
#include "oaslam/map/map.h"
#include "oaslam/viewer/message.h"

namespace oaslam {

// Adds to a message the difference between a snapshot and a later one of the same map: new and
// changed elements, and the ids of erased ones. With `before` null it adds everything. Pages of
// tables that both snapshots share cost nothing. Nothing is added where nothing changed.
void AddMapDelta(const Map* before, const Map& now, const ClassNames& names,
                 MessageBuilder& message);

nlohmann::json DescribeObject(ObjectId id, const Object& object, const ClassNames& names);

// [qx, qy, qz, qw, x, y, z] of world_from_cam, as the page expects it.
std::array<float, 7> PoseNumbers(const Rigid3& world_from_cam);

}  // namespace oaslam
