#pragma once

#include <map>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/slam.h"

namespace oaslam {

// Counts, while a map is only read, which of its mapped objects the images show in their places,
// and which they should show there and do not.
class ObjectAudit {
 public:
  // Adds the detections of a frame whose pose in the map is known.
  void Add(const Frame& frame, const Rigid3& cam_from_world, const Map& map,
           const ObjectsConfig& config);
  std::vector<ObjectPresence> Report() const;

 private:
  struct Audited {
    ObjectPresence presence;
    // Evidence that the object is gone, summed over all frames without Object::absence's bound at
    // 0.
    double absence = 0;
  };
  std::map<ObjectId, Audited> audited_;
  std::optional<double> last_time_;
};

}  // namespace oaslam
