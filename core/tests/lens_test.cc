// What a film of the desk shows through a lens that changes, and a camera that hangs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "desk_clip.h"

namespace oaslam {
namespace {

// The images of the desk through a lens whose focal length is `ratio` times the camera's.
cv::Mat Through(double ratio, const Camera& camera, const cv::Mat& image) {
  const cv::Matx23d map(ratio, 0, (1 - ratio) * camera.cx, 0, ratio, (1 - ratio) * camera.cy);
  cv::Mat zoomed;
  cv::warpAffine(image, zoomed, map, image.size(), cv::INTER_CUBIC);
  return zoomed;
}

class PresentLensTest : public testing::Test {
 protected:
  // `ratio_at`: by image.
  template <typename RatioAt>
  static std::vector<TrackingResult> Run(const RatioAt& ratio_at) {
    Slam slam(SlamConfig::Offline(), clip().camera);
    std::vector<TrackingResult> results;
    for (size_t i = 0; i < clip().images.size(); ++i) {
      ImageInput input = clip().images[i];
      input.detections_follow = false;
      if (ratio_at(i) != 1) input.image = Through(ratio_at(i), clip().camera, input.image);
      results.push_back(slam.Process(input));
    }
    return results;
  }
  static const std::vector<TrackingResult>& Steady() {
    static const std::vector<TrackingResult> steady = Run([](size_t) { return 1.0; });
    return steady;
  }
  static const Clip& clip() {
    static const Clip clip(0, 120);
    return clip;
  }
  // The distance of the camera to where it is without a change of the lens, of its way.
  static double Off(const TrackingResult& result) {
    const TrackingResult& right = Steady().at(static_cast<size_t>(result.frame));
    const auto pose = result.PoseIn(result.world), truth = right.PoseIn(right.world),
               begin = Steady().at(30).PoseIn(right.world);
    if (!pose || !truth || !begin) return INFINITY;
    return (pose->translation - truth->translation).norm() /
           (truth->translation - begin->translation).norm();
  }
};

TEST_F(PresentLensTest, ALensThatStaysHasTheRatioOne) {
  for (const TrackingResult& result : Steady()) EXPECT_EQ(result.focal_ratio, 1);
}

TEST_F(PresentLensTest, AZoomIsFollowed) {
  constexpr double kZoom = 1.25;
  const std::vector<TrackingResult> results = Run([](size_t i) {
    return std::pow(kZoom, std::clamp((static_cast<double>(i) - 60) / 25, 0.0, 1.0));
  });
  for (size_t i = 0; i < 60; ++i) EXPECT_EQ(results[i].focal_ratio, 1);
  EXPECT_NEAR(results[70].focal_ratio, std::pow(kZoom, 0.4), 0.03);
  EXPECT_TRUE(results[80].is_uncertain);
  EXPECT_NEAR(results.back().focal_ratio, kZoom, 0.05);
  EXPECT_LT(Off(results.back()), 0.15);
}

TEST_F(PresentLensTest, AMapThatIsOnlyReadIsSeenThroughAZoom) {
  Slam slam(SlamConfig::Offline(), clip().camera);
  TrackingResult result;
  for (size_t i = 0; i < clip().images.size(); ++i) {
    if (i == 60) slam.SetMapping(false);
    ImageInput input = clip().images[i];
    input.detections_follow = false;
    input.detections = clip().detections[i];
    const double zoom = std::pow(1.2, std::clamp((static_cast<double>(i) - 65) / 25, 0.0, 1.0));
    if (zoom != 1) {
      input.image = Through(zoom, clip().camera, input.image);
      input.detections.clear();
    }
    result = slam.Process(input);
  }
  EXPECT_NEAR(result.focal_ratio, 1.2, 0.05);
  EXPECT_LT(Off(result), 0.2);
  EXPECT_TRUE(slam.Relocalize(clip().images.back(),
                              {.mode = RelocalizationMode::kPoints, .camera = clip().camera})
                  .world_from_cam);
}

TEST_F(PresentLensTest, AnotherLensIsFoundByTheMap) {
  constexpr double kRatio = 1.6;
  const std::vector<TrackingResult> results = Run([](size_t i) { return i < 80 ? 1.0 : kRatio; });
  EXPECT_EQ(results[79].focal_ratio, 1);
  EXPECT_NEAR(results.back().focal_ratio, kRatio, 0.05);
  EXPECT_LT(Off(results.back()), 0.15);
}

TEST(RepeatedImages, APoseByARepeatedImageIsUncertain) {
  const Clip clip(0, 100);
  Slam slam(SlamConfig::Offline(), clip.camera);
  TrackingResult result;
  for (const ImageInput& image : clip.images) result = slam.Process(image);
  ASSERT_TRUE(result.HasPose());
  EXPECT_FALSE(result.is_uncertain);
  EXPECT_GT(result.confidence, 0.9);
  ImageInput frozen = clip.images.back();
  for (int i = 0; i < 3; ++i) {  // a tenth of a second: a video may repeat an image
    frozen.timestamp += 1.0 / 30;
    result = slam.Process(frozen);
  }
  EXPECT_FALSE(result.is_uncertain);
  for (int i = 0; i < 10; ++i) {
    frozen.timestamp += 1.0 / 30;
    result = slam.Process(frozen);
  }
  EXPECT_TRUE(result.HasPose());
  EXPECT_TRUE(result.is_uncertain);
  EXPECT_LT(result.confidence, 0.9);
}

}  // namespace
}  // namespace oaslam
