#pragma once

#include <Eigen/Core>
#include <string>

#include "oaslam/angular_velocity.h"

namespace oaslam {

// What is wrong with a sample of a gyroscope; an empty text where nothing is. `last`: the time
// stamp of the sample before; null: there is none.
std::string ProblemOf(const AngularVelocity& sample, const double* last);

// The same of an accelerometer, m/s^2.
std::string ProblemOfAcceleration(const Eigen::Vector3d& acceleration);

}  // namespace oaslam
