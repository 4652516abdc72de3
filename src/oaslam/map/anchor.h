#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "oaslam/rigid3.h"
#include "oaslam/util/ids.h"

namespace oaslam {

struct Map;

// A named place in the map where virtual content stands. It is carried by a keyframe, so that
// bundle adjustment and loops move it as they move what is around it; one on an object stays with
// the object, wherever that goes. The content's frame: y up, standing on the origin, its front
// towards +z, as in glTF.
struct Anchor {
  std::string model;       // what stands there, by a name that a renderer knows
  double size = 0;         // of the content's longest side, map units
  KeyframeId keyframe;     // in the map, or retired
  Rigid3 cam_from_anchor;  // camera of the keyframe
  ObjectId object;         // invalid: on no object
  Eigen::Vector3d offset =
      Eigen::Vector3d::Zero();  // from the object's center, in the keyframe's axes

  bool operator==(const Anchor& other) const;

  void Scale(double factor) {
    size *= factor;
    cam_from_anchor.translation *= factor;
    offset *= factor;
  }
};

// Where it is now. An anchor whose object is gone stays where its keyframe has it; nothing without
// its keyframe.
std::optional<Rigid3> WorldFromAnchor(const Map& map, const Anchor& anchor);

}  // namespace oaslam
