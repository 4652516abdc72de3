#pragma once

#include <cstdint>
#include <memory>

#include "oaslam/class_names.h"
#include "oaslam/map/map.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/relocalization/landmark_index.h"
#include "oaslam/storage/map_file.h"

namespace oaslam {

// The map of a snapshot, shared with all that refer to it.
struct OASLAM_LOCAL MapSnapshot::Content {
  std::shared_ptr<const Map> map;
  std::shared_ptr<const ClassNames> names;
  int first_frame = 0;  // keyframes of earlier frames are from a file
  uint64_t version = 0;
  WorldId world{};
  // All that a file holds; null where only the map is known.
  std::shared_ptr<const SavedMap> saved{};
  std::shared_ptr<const LandmarkIndex> index{};  // of the map's places; null where none was made
};

// A world that no other map has.
WorldId NewWorld();

inline const std::shared_ptr<const Map>& MapOf(const MapSnapshot& snapshot) {
  return snapshot.content()->map;
}
// What a file of this snapshot holds.
SavedMap SavedMapOf(const MapSnapshot& snapshot);
// A snapshot of `saved`, whose map has the given world and version.
MapSnapshot SnapshotOf(SavedMap saved, WorldId world, uint64_t version);
// The same map with an index of its places.
MapSnapshot Indexed(const MapSnapshot& snapshot);

// The snapshots of one Slam. Their versions ascend, whichever map it works with.
class SnapshotSeries {
 public:
  // The same snapshot as long as all arguments are the same.
  MapSnapshot Of(const std::shared_ptr<const Map>& map,
                 const std::shared_ptr<const ClassNames>& names, int first_frame, WorldId world);

 private:
  MapSnapshot newest_;
  uint64_t version_ = 0;
};

}  // namespace oaslam
