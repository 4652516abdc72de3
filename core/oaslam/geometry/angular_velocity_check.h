#pragma once

#include <string>

#include "oaslam/angular_velocity.h"

namespace oaslam {

// What is wrong with a sample of a gyroscope; an empty text where nothing is. `last`: the time
// stamp of the sample before; null: there is none.
std::string ProblemOf(const AngularVelocity& sample, const double* last);

}  // namespace oaslam
