#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace oaslam {

// A key point of an image and its ORB descriptor.
struct ImageFeature {
  // In the ideal image, without the distortion of the lens; pixels.
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float angle_rad = 0;  // orientation of the patch, [0, 2 pi)
  uint8_t level = 0;    // of the pyramid
  std::array<uint64_t, 4> descriptor{};
};

// The key points of an image, taken elsewhere by the extractor of this library (docs/odometry-js.md
// has it for browsers), so that the image need not be sent. Slam finds no landmark by the
// descriptors of another extractor.
struct ImageFeatures {
  std::vector<ImageFeature> features;  // at most 65535
  int levels = 8;                      // of the pyramid, 1 to 16
  double factor = 1.2;                 // from level to level, (1, 4]
  // Size of a pixel of the lowest level in pixels of the image, at least .1.
  double lowest_pixel = 1;
};

}  // namespace oaslam
