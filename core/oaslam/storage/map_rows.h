#pragma once

#include "oaslam/storage/map_file.h"
#include "oaslam/storage/map_part.h"

namespace oaslam {

// Each function reads tables of a map file, or the rows of a range of ids, adds them to the
// checksum and to the map, and throws SQLite::Exception where a row is not what it should be.
void ReadMeta(SQLite::Database& database, Checksum& checksum, Map& map);
void ReadCameras(SQLite::Database& database, Checksum& checksum, Map& map);
void ReadKeyframes(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadRetiredKeyframes(SQLite::Database& database, Checksum& checksum, Map& map);
// The keyframes must be in the map already, and so must the landmarks of observations.
void ReadFeatures(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadCovisibility(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadLandmarks(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadObservations(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map);
void ReadObjects(SQLite::Database& database, Checksum& checksum, Map& map);
void ReadTrajectory(SQLite::Database& database, Checksum& checksum, SavedMap& saved);
void ReadRecordings(SQLite::Database& database, Checksum& checksum, SavedMap& saved);
void ReadClassNames(SQLite::Database& database, Checksum& checksum, SavedMap& saved);
void ReadAnchors(SQLite::Database& database, Checksum& checksum, Map& map);
// The columns of an anchor that follow its name.
Anchor ReadAnchor(RowReader& row);

// Fills Keyframe::landmarks from the observations of the landmarks.
void LinkKeyframes(Map& map);

}  // namespace oaslam
