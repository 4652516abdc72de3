#pragma once

#include <Eigen/Core>

#include "oaslam/odometry/grey_pyramid.h"

namespace oaslam {

// By how many pixels of the lowest level the content of an image has moved to the next one, as a
// whole: the shift with the highest correlation of their small versions (as by Klein and Murray
// 2008, "Improving the agility of keyframe-based SLAM", section 4). It needs no guess, is right to
// about a 40th of the width, and looks as far as two thirds of the image. Parts that move with the
// camera pull it towards zero.
Eigen::Vector2f ShiftOfImage(const GreyPyramid& last, const GreyPyramid& next);

}  // namespace oaslam
