#include "oaslam/features/orb_extractor.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "grey_scene.h"
#include "oaslam/features/keypoint_spread.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

const Camera kCamera{.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240};

GreyBuffer Scene(uint64_t seed) {
  return synthetic::RandomScene(kCamera.width, kCamera.height, seed);
}

TEST(OrbExtractor, FindsTheNumberAskedForOnEveryLevelInsideTheImage) {
  const Features f = OrbExtractor({}, kCamera).Extract(Scene(1).view(), 1000);
  EXPECT_NEAR(f.size(), 1000, 60);
  EXPECT_EQ(f.descriptors.size(), f.keypoints.size());
  std::array<int, 8> per_level{};
  for (const Keypoint& k : f.keypoints) {
    ++per_level[k.octave];
    EXPECT_TRUE(k.px.x() >= 15 && k.px.x() < 625 && k.px.y() >= 15 && k.px.y() < 465)
        << k.px.transpose();
  }
  for (const int n : per_level) EXPECT_GT(n, 20);
  EXPECT_GT(per_level[0], per_level[7]);
}

TEST(OrbExtractor, KeyPointsBeyondTheLensModelAreNotUsed) {
  // Equidistant: 90 degrees off the axis are 314 px, so that the left and the right of the image
  // are behind the camera.
  Camera fisheye = kCamera;
  fisheye.model = LensModel::kFisheye;
  fisheye.fx = fisheye.fy = 200;
  const Features f = OrbExtractor({}, fisheye).Extract(Scene(1).view(), 1000);
  EXPECT_GT(f.size(), 600);
  EXPECT_LT(f.size(), OrbExtractor({}, kCamera).Extract(Scene(1).view(), 1000).size());
  EXPECT_EQ(f.descriptors.size(), f.keypoints.size());
  for (const Keypoint& k : f.keypoints) {
    const Eigen::Vector2d pixel = Distort(fisheye, k.px.cast<double>());
    EXPECT_LT((pixel - Eigen::Vector2d(320, 240)).norm(), 1.55 * 200 + 0.01);
    EXPECT_LT((pixel - Eigen::Vector2d(320, 240)).cwiseAbs().y(), 240);
  }
}

TEST(OrbExtractor, NothingIsUsedThatAMaskHides) {
  GreyBuffer visible(4, 4);  // the lowest quarter is hidden
  for (int y = 0; y < 3; ++y) std::fill_n(visible.Row(y), 4, uint8_t{255});
  OrbExtractor orb({}, kCamera);
  orb.SetMask(ImageMask(visible.view()));
  const Features f = orb.Extract(Scene(1).view(), 1000);
  EXPECT_NEAR(f.size(), 1000, 60);  // the rest gets as many
  float lowest = 0;
  for (const Keypoint& k : f.keypoints) lowest = std::max(lowest, k.px.y());
  EXPECT_LT(lowest, 360);
  EXPECT_GT(lowest, 330);
  orb.SetMask({});
  EXPECT_EQ(orb.Extract(Scene(1).view(), 1000).descriptors,
            OrbExtractor({}, kCamera).Extract(Scene(1).view(), 1000).descriptors);
}

TEST(OrbExtractor, TheSameImageGivesTheSameFeatures) {
  OrbExtractor orb({}, kCamera);
  const Features a = orb.Extract(Scene(2).view(), 500), b = orb.Extract(Scene(2).view(), 500);
  EXPECT_GT(a.size(), 400);
  EXPECT_EQ(a.descriptors, b.descriptors);
}

TEST(OrbExtractor, DescriptorsSurviveARotationOfTheImage) {
  const GreyBuffer image = Scene(3);
  const Eigen::Vector2d center(320, 240);
  const Eigen::Rotation2Dd turn(35 * std::numbers::pi / 180);
  const GreyBuffer rotated = synthetic::Drawn(640, 480, [&](int x, int y) {
    const Eigen::Vector2d p = center + turn.inverse() * (Eigen::Vector2d(x, y) - center);
    const int left = static_cast<int>(std::floor(p.x())), top = static_cast<int>(std::floor(p.y()));
    if (left < 0 || left > 638 || top < 0 || top > 478) return 0.0;
    const double u = p.x() - left, v = p.y() - top;
    const auto row = [&](int i) {
      return (1 - u) * image.Row(i)[left] + u * image.Row(i)[left + 1];
    };
    return (1 - v) * row(top) + v * row(top + 1);
  });
  OrbExtractor orb({}, kCamera);
  const Features a = orb.Extract(image.view(), 1000), b = orb.Extract(rotated.view(), 1000);
  int checked = 0, matched = 0;
  for (int i = 0; i < a.size(); ++i) {
    const Eigen::Vector2d there = center + turn * (a.keypoints[i].px.cast<double>() - center);
    int best = 256;
    b.VisitNear(there, 3, [&](int j) {
      best = std::min(best, HammingDistance(a.descriptors[i], b.descriptors[j]));
    });
    if (best == 256) continue;
    ++checked;
    matched += best <= 50;
  }
  EXPECT_GT(checked, 150);
  EXPECT_GT(matched, checked * 0.6);
}

TEST(OrbExtractor, AnImageOfTwiceTheResolutionHasTheSameFeatures) {
  const GreyBuffer image = Scene(4);
  const GreyBuffer doubled =
      synthetic::Drawn(1280, 960, [&](int x, int y) { return image.Row(y / 2)[x / 2]; });
  const Camera camera{.width = 1280, .height = 960, .fx = 1000, .fy = 1000, .cx = 640, .cy = 480};
  const Features small = OrbExtractor({}, kCamera).Extract(image.view(), 1000),
                 large = OrbExtractor({}, camera).Extract(doubled.view(), 1000);
  EXPECT_GT(small.size(), 900);
  EXPECT_EQ(small.descriptors, large.descriptors);
  EXPECT_FLOAT_EQ(static_cast<float>(large.pyramid.working_pixel()), 2);
  for (int i = 0; i < std::min(small.size(), large.size()); ++i)
    EXPECT_LT(
        (2 * small.keypoints[i].px + Eigen::Vector2f(0.5F, 0.5F) - large.keypoints[i].px).norm(),
        1e-3F);
}

TEST(OrbExtractor, AVerySmallImageIsEnlarged) {
  const GreyBuffer image = synthetic::RandomScene(160, 120, 5);
  const Camera camera{.width = 160, .height = 120, .fx = 125, .fy = 125, .cx = 80, .cy = 60};
  const Features f = OrbExtractor({}, camera).Extract(image.view(), 300);
  EXPECT_FLOAT_EQ(static_cast<float>(f.pyramid.working_pixel()), 0.5F);
  EXPECT_GT(f.size(), 200);
  for (const Keypoint& k : f.keypoints)
    EXPECT_TRUE(k.px.x() > 9 && k.px.x() < 150 && k.px.y() > 9 && k.px.y() < 110)
        << k.px.transpose();
}

TEST(OrbExtractor, ABlackOrATinyImageHasNoFeatures) {
  EXPECT_EQ(OrbExtractor({}, kCamera).Extract(GreyBuffer(640, 480).view(), 1000).size(), 0);
  Camera tiny = kCamera;
  tiny.width = tiny.height = 20;
  EXPECT_EQ(OrbExtractor({}, tiny).Extract(GreyBuffer(20, 20).view(), 1000).size(), 0);
}

TEST(SpreadKeypoints, TakesTheStrongestOfEachPlace) {
  std::vector<Corner> corners;
  for (int i = 0; i < 500; ++i)
    corners.push_back({10 + i % 25 / 2, 10 + i / 50, static_cast<uint8_t>(1 + i / 2)});
  corners.push_back({90, 90, 1});
  const auto chosen = SpreadKeypoints(corners, {0, 0, 100, 100}, 10);
  EXPECT_LE(chosen.size(), 13U);
  EXPECT_GE(chosen.size(), 8U);
  EXPECT_TRUE(std::ranges::any_of(chosen, [](const Corner& c) { return c.x == 90; }));
  EXPECT_TRUE(std::ranges::any_of(chosen, [](const Corner& c) { return c.score == 250; }));
}

TEST(Features, GridFindsWhatIsNear) {
  Features f;
  f.bounds = {0, 0, 640, 480};
  Rng rng(5);
  for (int i = 0; i < 800; ++i)
    f.keypoints.push_back(
        {{static_cast<float>(rng.Uniform(0, 640)), static_cast<float>(rng.Uniform(0, 480))}, 0, 0});
  f.BuildGrid();
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector2d p(rng.Uniform(-20, 660), rng.Uniform(-20, 500));
    const double r = rng.Uniform(1, 80);
    std::vector<int> found, expected;
    f.VisitNear(p, r, [&](int i) { found.push_back(i); });
    for (int i = 0; i < f.size(); ++i)
      if (std::abs(f.keypoints[i].px.x() - p.x()) < r &&
          std::abs(f.keypoints[i].px.y() - p.y()) < r)
        expected.push_back(i);
    std::ranges::sort(found);
    EXPECT_EQ(found, expected);
  }
}

TEST(Features, ForgetsTheKeypointsInBoxesAndKeepsTheOthersWhole) {
  Features f;
  f.bounds = {0, 0, 640, 480};
  for (int i = 0; i < 640; i += 10) {
    f.keypoints.push_back({{static_cast<float>(i), 100}, 0, 0});
    f.descriptors.push_back({static_cast<uint64_t>(i), 0, 0, 0});
  }
  const Box boxes[] = {{95, 50, 205, 150}, {400, 0, 500, 90}};
  f.EraseKeypointsIn(boxes);
  EXPECT_EQ(f.size(), 64 - 11);
  ASSERT_EQ(f.keypoints.size(), f.descriptors.size());
  for (int i = 0; i < f.size(); ++i) {
    EXPECT_EQ(f.descriptors[i][0], static_cast<uint64_t>(f.keypoints[i].px.x()));
    EXPECT_FALSE(f.keypoints[i].px.x() > 95 && f.keypoints[i].px.x() < 205);
  }
  int near = 0;
  f.VisitNear({300, 100}, 15, [&](int i) { near += f.keypoints[i].px.x() > 280; });
  EXPECT_EQ(near, 3);
}

}  // namespace
}  // namespace oaslam
