#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>

#include "oaslam/rigid3.h"

namespace oaslam {

// Poses as numbers of a text file, which are rounded.

// The first three rows of a matrix of 3 x 4 or 4 x 4 numbers, row by row; nothing where its first
// three columns are no rotation within errors of the size `rounded`.
std::optional<Rigid3> PoseOfRows(std::span<const double> rows, double rounded = 1e-2);

// Throws InputError, which begins with `place`, for a quaternion whose length is not about 1.
Rigid3 PoseOfQuaternion(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation,
                        const std::string& place);

}  // namespace oaslam
