#pragma once

#include "oaslam/formats/class_names.h"
#include "oaslam/map/map.h"
#include "oaslam/viewer/message.h"

namespace oaslam {

// Adds to a message what leads from one snapshot to a later one of the same map: what is new or
// changed, and the ids of what is gone. `before` null: everything. Pages that both snapshots share
// cost nothing. Nothing is added where nothing changed.
void AddMapDelta(const Map* before, const Map& now, const ClassNames& names,
                 MessageBuilder& message);

// Of a map object, for display.
nlohmann::json DescribeObject(ObjectId id, const Object& object, const ClassNames& names);

// [qx, qy, qz, qw, x, y, z] of camera to world, as the page takes it.
std::array<float, 7> PoseNumbers(const Rigid3& world_from_cam);

}  // namespace oaslam
