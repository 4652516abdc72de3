// Detections that an application gives to Slam are checked as those of files are.

#include <gtest/gtest.h>

#include <limits>

#include "expect_input_error.h"
#include "oaslam/slam.h"
#include "offline_config.h"

namespace oaslam {
namespace {

const Camera kCamera{.width = 320, .height = 240, .fx = 260, .fy = 260, .cx = 159.5, .cy = 119.5};

ImageInput Image(double timestamp, std::vector<Detection> detections = {}) {
  return {.image = cv::Mat(240, 320, CV_8UC1, cv::Scalar(100)),
          .timestamp = timestamp,
          .detections = std::move(detections)};
}

TEST(DetectionInput, EveryWayInChecksTheBoxes) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Detection good{.category_id = 41, .score = 0.9, .box = {10, 10, 60, 60}};
  for (const Box& box : {Box{10, 10, nan, 60}, Box{60, 10, 10, 60}, Box{10, 10, 1e9, 60}}) {
    Slam slam(OfflineIn(), kCamera);
    const std::vector<Detection> bad{good, {.category_id = 41, .score = 0.9, .box = box}};
    const auto is_named = AllOf(HasSubstr("detection 1"), HasSubstr("box: ["));
    EXPECT_INPUT_ERROR(slam.Process(Image(1, bad)), is_named);
    ImageInput follows = Image(1);
    follows.detections_follow = true;
    const int frame = slam.Process(follows).frame;  // the refused input had no effect
    EXPECT_EQ(frame, 0);
    EXPECT_INPUT_ERROR(slam.AddDetections(frame, bad), is_named);
    EXPECT_INPUT_ERROR(slam.Relocalize(Image(2, bad)), is_named);
    EXPECT_INPUT_ERROR(slam.Relocalize(Image(2, bad), {.unknown_camera = true}), is_named);
    EXPECT_INPUT_ERROR(slam.Relocalize({.image = {}, .detections = bad}), is_named);
  }
}

}  // namespace
}  // namespace oaslam
