#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "oaslam/anchors/editing.h"
#include "oaslam/map_localizer.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/service/map_store.h"

namespace oaslam {

// The memory that a map takes, estimated.
size_t BytesInMemory(const SavedMap& saved);

// One version of a map, loaded. Never changes; shared by all that use it.
struct ServedMap {
  // Reads the file. Throws InputError where it is no map.
  ServedMap(const MapFile& file, const SlamConfig& config);

  StoredMap stored;
  MapLocalizer localizer;
  size_t bytes = 0;  // of memory, estimated

  const SavedMap& saved() const { return *localizer.map().content()->saved; }
};

// What was edited of a map: a value that is replaced as a whole.
struct MapEdits {
  int64_t version = 0, map_version = 0;        // as of AnchorEdits
  std::map<std::string, AnchorEntry> anchors;  // the newest edit of each
};

// A map with the anchors that it has now: those of its file, as they were edited.
Map WithEdits(const Map& map, const MapEdits& edits);

struct VersionedAnchor {
  AnchorPose pose;
  int64_t version = 0;  // 0: as in the map's file
};
// The anchors that have a place in the map, and the names of those that are gone, of all that were
// edited after `since`. All of them where `since` is 0, or the map was removed or replaced after
// it: then it is not known which others a client has.
struct AnchorNews {
  bool is_complete = false;
  std::vector<VersionedAnchor> anchors;
  std::vector<std::string> removed;
};
AnchorNews NewsOf(const Map& map, const MapEdits& edits, int64_t since);

}  // namespace oaslam
