#pragma once

#include <cstdint>
#include <memory>

#include "oaslam/class_names.h"
#include "oaslam/map/map.h"
#include "oaslam/map_snapshot.h"

namespace oaslam {

// Makes the MapSnapshots that applications get.
class SnapshotMaker {
 public:
  // Shares both. `names`: of the classes. `first_frame`: keyframes of earlier frames are from a
  // file.
  static MapSnapshot Of(std::shared_ptr<const Map> map, std::shared_ptr<const ClassNames> names,
                        int first_frame, uint64_t version);
};

// The snapshots of one Slam. Their versions ascend, whichever map it works with.
class SnapshotSeries {
 public:
  // The same snapshot as long as map and names are the same.
  MapSnapshot Of(const std::shared_ptr<const Map>& map,
                 const std::shared_ptr<const ClassNames>& names, int first_frame) {
    if (map != map_ || names != names_)
      newest_ = SnapshotMaker::Of(map_ = map, names_ = names, first_frame, ++version_);
    return newest_;
  }

 private:
  std::shared_ptr<const Map> map_;
  std::shared_ptr<const ClassNames> names_;
  uint64_t version_ = 0;
  MapSnapshot newest_;
};

}  // namespace oaslam
