#pragma once

#include <memory>

#include "oaslam/class_names.h"
#include "oaslam/map/map.h"
#include "oaslam/map_snapshot.h"

namespace oaslam {

// Makes the handle to a map that applications get.
class SnapshotMaker {
 public:
  // Shares both. `names`: of the classes.
  static MapSnapshot Of(std::shared_ptr<const Map> map, std::shared_ptr<const ClassNames> names);
};

}  // namespace oaslam
