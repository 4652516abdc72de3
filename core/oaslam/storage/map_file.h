#pragma once

#include <limits>
#include <string>
#include <vector>

#include "oaslam/class_names.h"
#include "oaslam/map/submap.h"
#include "oaslam/storage/recordings.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// The content of a map file.
struct SavedMap {
  Map map;
  std::vector<FramePose> trajectory;
  ClassNames class_names;  // at least those of the categories of its objects
  // Submaps that could not be joined with the map, largest first; no two of them, nor the map,
  // share an id.
  std::vector<Submap> submaps{};
  MapRecordings recordings{};  // of the map and its submaps
};

// The number of frames that the map, its submaps and their trajectories refer to: one more than the
// largest frame index.
int FramesOf(const SavedMap& saved);

// The poses in the world of those frames from `first_frame` on whose keyframe is, or was, in the
// map.
std::vector<StampedPose> WorldPoses(const Map& map, const std::vector<FramePose>& frames,
                                    int first_frame = std::numeric_limits<int>::min());
// The poses of the keyframes of these frames, by time.
std::vector<StampedPose> KeyframePoses(const Map& map,
                                       int first_frame = std::numeric_limits<int>::min());

// Writes one SQLite file under another name and renames it to `path`, so that a crash leaves the
// old one intact (docs/formats.md has the schema). Equal maps give equal content:
// save(load(save(m))) is byte-equal. If a map violates its invariants, which only a defect of this
// library can cause, the elements concerned are left out, with a warning. Throws InputError.
void SaveMap(const std::string& path, const SavedMap& saved);

// The map file that a path names: map.oaslam in a folder of results, else the path itself.
std::string MapFileAt(const std::string& path);

// Whether the file (MapFileAt) is an SQLite file, as map files of all format versions are.
bool IsMapFile(const std::string& path);

// Loads a map file (MapFileAt) after verifying application id, version, integrity, content checksum
// and the map's invariants. Recordings of files that do not name them are those of
// RecordingsByTime. Throws InputError.
SavedMap LoadMap(const std::string& path);
// Exchanges the map with one of the submaps: 0 is the map itself, the others are counted from 1.
// Throws InputError naming `path` where there is no such submap.
void LeadWithSubmap(const std::string& path, int submap, SavedMap& saved);
// Loads a map file (MapFileAt), with the chosen submap as the map and without the others.
SavedMap LoadSubmap(const std::string& path, int submap);

}  // namespace oaslam
