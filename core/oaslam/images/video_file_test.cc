#include "oaslam/images/video_file.h"

#include <filesystem>
#include <optional>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/image_source.h"

namespace oaslam {
namespace {

cv::Mat Picture(int brightness) { return {121, 161, CV_8UC3, cv::Scalar::all(brightness)}; }

struct VideoFileTest : FolderTest {};

TEST_F(VideoFileTest, IsReadAsItWasWritten) {
  for (const int count : {1, 5, 40}) {  // fewer than tell the rate, and more
    const std::string path = folder / "a.mp4";
    {
      VideoFile video(path);
      for (int i = 0; i < count; ++i) video.Add(Picture(5 * i), 100 + i / 12.5);
    }  // whole without Finish, as after an error
    const auto source = OpenImages(path, {});
    for (int i = 0; i < count; ++i) {
      const std::optional<InputImage> image = source->Next();
      ASSERT_TRUE(image) << i;
      EXPECT_EQ(image->image.size(), cv::Size(162, 122));
      EXPECT_NEAR(cv::mean(image->image)[0], 5 * i, 4);
      EXPECT_NEAR(image->timestamp, i / (count > 1 ? 12.5 : 30), 1e-3);
    }
    EXPECT_FALSE(source->Next());
  }
}

TEST_F(VideoFileTest, WithoutPicturesLeavesNothing) {
  VideoFile(folder / "a.mp4").Finish();
  EXPECT_FALSE(std::filesystem::exists(folder / "a.mp4"));
}

TEST_F(VideoFileTest, RefusesWhatCannotBeWritten) {
  const auto refusal = [](const std::string& path) {
    return InputErrorOf([&] { const VideoFile video(path); });
  };
  EXPECT_THAT(refusal(folder / "a.avi"),
              HasSubstr("a.avi: not a video that can be written; allowed: .mp4"));
  EXPECT_THAT(refusal(folder / "nowhere/a.mp4"), HasSubstr("there is no folder"));
  std::filesystem::create_directory(folder / "b.mp4");
  EXPECT_THAT(refusal(folder / "b.mp4"), HasSubstr("b.mp4: is a folder"));
  EXPECT_THAT(refusal("/proc/a.mp4"), HasSubstr("/proc/a.mp4: cannot be written"));
}

TEST(FrameRateOf, IsTheMedianWithinBounds) {
  EXPECT_EQ(FrameRateOf({}), 30);
  EXPECT_EQ(FrameRateOf({5}), 30);
  EXPECT_EQ(FrameRateOf({0, 0.1, 0.2, 0.3, 5}), 10);
  EXPECT_EQ(FrameRateOf({0, 1001.0 / 30000, 2002.0 / 30000}), 29.97);
  EXPECT_EQ(FrameRateOf({0, 0.001}), 60);
  EXPECT_EQ(FrameRateOf({0, 10}), 1);
}

}  // namespace
}  // namespace oaslam
