#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "oaslam/rigid3.h"

namespace oaslam {

// A named place in the map where virtual content stands.
struct AnchorPose {
  std::string name, model;         // model: what stands there, by a name that the application knows
  double size = 0;                 // of the content's longest side, map units
  Rigid3 world_from_anchor;        // content: y up, standing on the origin, front towards +z (glTF)
  std::optional<uint32_t> object;  // it stands on
};

// Where content is to stand: where a ray, as of a click in an image, meets the map. Map frame, any
// length.
struct AnchorRequest {
  std::string name;  // empty: that of the model, with a number
  std::string model;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::Zero();
  std::optional<uint32_t>
      object;  // on top of this mapped object; else on the plane that landmarks about the ray span
  double size = 0;  // map units; 0: as fits the place
};

struct AnchorReport {
  std::string name;  // of the new anchor; empty: there is none
  std::string why_not;
};

// What is to change of an anchor.
struct AnchorEdit {
  std::optional<std::string> name;
  std::optional<double> size;  // map units
  double turn_rad = 0;         // about its y axis
};

}  // namespace oaslam
