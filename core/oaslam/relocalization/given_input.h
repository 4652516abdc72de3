#pragma once

#include <memory>

#include "oaslam/features/features.h"
#include "oaslam/image_features.h"
#include "oaslam/map/frame.h"
#include "oaslam/motion_input.h"

namespace oaslam {

// Conversions of what an application has computed itself, instead of Slam: the key points of an
// image, and the camera's motion. CheckFeatures and CheckMotion throw InputError.

void CheckFeatures(const ImageFeatures& given);
void CheckMotion(const MotionInput& given);

// `bounds`: of the ideal image.
Features FeaturesOf(const ImageFeatures& given, const Box& bounds);

// Null where the motion is not known. The run of the result is negative, so that it never equals a
// run of Slam's own odometry.
std::shared_ptr<const FrameMotion> MotionOf(const MotionInput& given, const Camera& camera);

}  // namespace oaslam
