#pragma once

#include <opencv2/core.hpp>

#include "oaslam/class_names.h"
#include "oaslam/content/ar_picture.h"

namespace oaslam {

// Draws the outlines of the mapped objects' ellipsoids, with one colour for each class, and their
// own names or those of their classes. Names that would cover those of nearer objects are left out.
void DrawOutlines(const ArFrame& frame, const ClassNames& names, cv::Mat& picture);

// Draws the line at the bottom: state, objects seen, confidence.
void DrawStatus(const ArFrame& frame, cv::Mat& picture);

}  // namespace oaslam
