#pragma once

#include "oaslam/ids.h"
#include "oaslam/map/map.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// The rotation from the world of a map to ROS' frame of a map: x forward as the first camera
// looks, y left, z up by the vertical of the map, or else by how the cameras were held.
Rigid3::Rotation RosFromWorld(const Map& map);

// How the frame `map` lies to the world of a map that grows.
class RosMapFrame {
 public:
  // Turns the frame where the map knows its vertical better by more than a degree; where "forward"
  // is stays as it was. Of another world the frame begins anew. Returns by what angle it was
  // turned, rad; 0: not, or begun anew.
  double Follow(const Map& map, WorldId world);
  Rigid3 map_from_world() const { return {rotation_, {0, 0, 0}}; }

 private:
  bool has_begun_ = false;
  WorldId world_;
  Rigid3::Rotation rotation_ = Rigid3::Rotation::Identity();
};

}  // namespace oaslam
