#include "oaslam/description/describe_features.h"

#include <cmath>
#include <numeric>
#include <vector>

#include "oaslam/description/corner_describer.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {

Features DescribeFeatures(const Features& features, const Camera& camera, const GreyImage& image,
                          std::span<const uint16_t> keypoints) {
  // The network's buffers are used by one thread at a time.
  thread_local CornerDescriber describer;
  const Eigen::Vector2d ratio(static_cast<double>(camera.width) / image.width,
                              static_cast<double>(camera.height) / image.height);
  std::vector<ScaledCorner> corners;
  for (const uint16_t k : keypoints) {
    const Keypoint& keypoint = features.keypoints[k];
    const Eigen::Vector2d raw = Distort(camera, keypoint.px.cast<double>());
    // Pixel centres are at integers, so that images of different sizes are aligned at corners.
    const Eigen::Vector2d px = (raw.array() + 0.5) / ratio.array() - 0.5;
    corners.push_back(
        {px.cast<float>(), static_cast<float>(features.pyramid.scale[keypoint.octave] /
                                              std::sqrt(ratio.x() * ratio.y()))});
  }
  Features described = features;
  described.learned = {{keypoints.begin(), keypoints.end()}, describer.Describe(image, corners)};
  return described;
}

Features DescribeFeatures(const Features& features, const Camera& camera, const GreyImage& image) {
  std::vector<uint16_t> all(features.keypoints.size());
  std::iota(all.begin(), all.end(), uint16_t{0});
  return DescribeFeatures(features, camera, image, all);
}

}  // namespace oaslam
