#pragma once

#include <map>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/slam.h"

namespace oaslam {

// Whether the objects of a map that is only read are still where it has them.
class ObjectAudit {
 public:
  // A frame whose pose was found.
  void Add(const Frame& frame, const Rigid3& cam_from_world, const Map& map,
           const ObjectsConfig& config);
  std::vector<ObjectPresence> Report() const;

 private:
  struct Audited {
    int category_id = 0, expected = 0, seen = 0;
    double absence = 0;  // evidence of all frames: here none is newer than the others
  };
  std::map<ObjectId, Audited> audited_;
  std::optional<double> last_time_;
};

}  // namespace oaslam
