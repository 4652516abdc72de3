#pragma once

#include "oaslam/rigid3.h"

namespace oaslam {

// How the camera turned between two times, by a gyroscope.
struct Turn {
  Rigid3::Rotation second_from_first = Rigid3::Rotation::Identity();
  double variance = 0;  // of the rotation about any axis, rad^2
};

}  // namespace oaslam
