#pragma once

#include <functional>
#include <optional>
#include <string>

#include "oaslam/storage/map_file.h"
#include "oaslam/storage/map_lock.h"

namespace oaslam {

// What a map file holds, as its checksums tell: two files with equal ones hold the same.
struct MapState {
  std::string content;  // everything
  std::string scene;    // everything but the objects and the anchors, which users edit

  bool operator==(const MapState&) const = default;
};

// The state of a map file (MapFileAt), without reading the map. Nothing where there is no map file
// that this program can read.
std::optional<MapState> StateOfMap(const std::string& path);

// Saves a map as SaveMap does, to the file of a lock that the caller has. `replaces`: throws
// InputError and writes nothing if the file's state is another one, as it may be where the folder
// cannot be locked.
void SaveMap(const SavedMap& saved, const MapLock& lock,
             const std::optional<MapState>& replaces = std::nullopt);

// Changes a map file (MapFileAt): loads it, calls `edit`, and saves it, while all others that
// change maps in its folder wait; so `edit` must not save one there. If it throws, the file stays
// as it is. Throws InputError.
void EditMap(const std::string& path, const std::function<void(SavedMap&)>& edit);

}  // namespace oaslam
