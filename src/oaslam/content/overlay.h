#pragma once

#include <opencv2/core.hpp>

#include "oaslam/content/ar_picture.h"
#include "oaslam/formats/class_names.h"

namespace oaslam {

// Outlines of the mapped objects' ellipsoids, a colour a class, with their own names or those of
// their classes; names that would cover those of nearer objects are left out.
void DrawOutlines(const ArFrame& frame, const ClassNames& names, cv::Mat& picture);

// The line at the bottom: state, objects seen, confidence.
void DrawStatus(const ArFrame& frame, cv::Mat& picture);

}  // namespace oaslam
