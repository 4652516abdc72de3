#pragma once

#include <cstdint>
#include <span>

#include "oaslam/camera.h"
#include "oaslam/features/features.h"
#include "oaslam/features/grey_image.h"

namespace oaslam {

// The features with learned descriptors of these key points (ascending), instead of those that they
// had. `image`: the camera's image, at any resolution with the same aspect ratio. Thread-safe;
// takes 30 ms on one core for 640 x 480 pixels.
Features DescribeFeatures(const Features& features, const Camera& camera, const GreyImage& image,
                          std::span<const uint16_t> keypoints);
// Describes all key points of `features`.
Features DescribeFeatures(const Features& features, const Camera& camera, const GreyImage& image);

}  // namespace oaslam
