#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "oaslam/ids.h"
#include "oaslam/rigid3.h"

namespace oaslam {

struct Map;

// A named place in the map where virtual content stands. Its pose is relative to a keyframe, so
// that it moves with the map around it in bundle adjustment and loop closing; an anchor on an
// object moves with the object. The content's frame: y up, standing on the origin, its front
// towards +z, as in glTF.
struct Anchor {
  std::string model;       // name of the model, known to the renderer
  double size = 0;         // of the content's longest side, map units
  KeyframeId keyframe;     // in the map, or retired
  Rigid3 cam_from_anchor;  // relative to the keyframe's camera
  ObjectId object;         // the object it stands on; invalid: none
  // From the object's center, in the keyframe's axes.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();

  bool operator==(const Anchor& other) const;

  void Scale(double factor) {
    size *= factor;
    cam_from_anchor.translation *= factor;
    offset *= factor;
  }
};

// The present pose of an anchor. An anchor whose object is gone keeps its pose relative to the
// keyframe; nothing where the keyframe is unknown.
std::optional<Rigid3> WorldFromAnchor(const Map& map, const Anchor& anchor);

}  // namespace oaslam
