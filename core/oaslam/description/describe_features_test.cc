#include "oaslam/description/describe_features.h"

#include <gtest/gtest.h>

#include <array>

#include "grey_scene.h"
#include "oaslam/description/corner_describer.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// Key points of the ideal image are described where the original one shows them, at the size that
// they have in a smaller copy of it.
TEST(Described, LooksWhereTheOriginalImageShowsTheKeyPoint) {
  Camera camera{.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 319.5, .cy = 239.5};
  camera.distortion = {-0.2, 0.05, 0.001, 0, 0};
  const GreyBuffer half = synthetic::RandomScene(320, 240, 1);
  const std::array<Eigen::Vector2d, 2> seen{Eigen::Vector2d(100, 60), Eigen::Vector2d(280, 200)};
  Features features;
  std::vector<ScaledCorner> corners;
  for (const Eigen::Vector2d& px : seen) {
    const Eigen::Vector2d original = 2 * px + Eigen::Vector2d(0.5, 0.5);
    features.keypoints.push_back({Undistort(camera, original).cast<float>(), 0, 2});
    features.descriptors.emplace_back();
    corners.push_back({px.cast<float>(), static_cast<float>(features.pyramid.scale[2] / 2)});
    EXPECT_GT((features.keypoints.back().px.cast<double>() - original).norm(), 3);
  }
  const auto expected = CornerDescriber().Describe(half.view(), corners);
  const Features all = DescribeFeatures(features, camera, half.view());
  EXPECT_EQ(all.learned.keypoints, (std::vector<uint16_t>{0, 1}));
  for (size_t i = 0; i < expected.size(); ++i)
    EXPECT_LE(HammingDistance(all.learned.descriptors.at(i), expected[i]), 4);
  const Features second =
      DescribeFeatures(features, camera, half.view(), std::array<uint16_t, 1>{1});
  EXPECT_EQ(second.learned.keypoints, std::vector<uint16_t>{1});
  EXPECT_LE(HammingDistance(second.learned.descriptors.at(0), expected[1]), 4);
}

}  // namespace
}  // namespace oaslam
