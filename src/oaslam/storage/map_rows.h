#pragma once

#include <cstdint>

#include "oaslam/storage/map_file.h"
#include "oaslam/storage/map_part.h"

namespace oaslam {

// Each function reads tables of a map file, or the rows of a range of ids, adds them to the
// checksum and to the map, and throws DatabaseError where a row is not what it should be.
void ReadMeta(Database& database, Checksum& checksum, Map& map);
void ReadCameras(Database& database, Checksum& checksum, Map& map);
void ReadKeyframes(Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadRetiredKeyframes(Database& database, Checksum& checksum, Map& map);
// Of keyframes that are in the map.
void ReadFeatures(Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadCovisibility(Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadLandmarks(Database& database, Checksum& checksum, IdRange range, Map& map);
// Of landmarks that are in the map. The keyframes get to know their landmarks by LinkKeyframes.
void ReadObservations(Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadObjects(Database& database, Checksum& checksum, Map& map);
void ReadTrajectory(Database& database, Checksum& checksum, SavedMap& saved);
void ReadClassNames(Database& database, Checksum& checksum, SavedMap& saved);
void ReadAnchors(Database& database, Checksum& checksum, Map& map);

// Tells the keyframes of a map which landmarks they see. The name of the database is used in
// messages.
void LinkKeyframes(const Database& database, Map& map);

}  // namespace oaslam
