#include "oaslam/images/recorded_images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "oaslam/error.h"
#include "oaslam/images/depth_files.h"
#include "oaslam/images/image_list.h"
#include "oaslam/images/recorded_depths.h"
#include "recording_writer.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int64_t kStart = 1'700'000'000'000'000'000, kStep = 50'000'000;

std::string ImageData(int64_t stamp, const std::string& encoding, const std::string& pixels) {
  return MessageWriter(MessageWriter::kCdr)
      .Header(stamp, "camera")
      .Put(uint32_t{1})
      .Put(uint32_t{2})
      .Text(encoding)
      .Put(uint8_t{0})
      .Put(static_cast<uint32_t>(pixels.size()))
      .Sequence(pixels)
      .Finish();
}

// Images, and depths 10 ms after every second one.
std::string Recording(const TempFolder& folder, bool has_stamps = true) {
  std::vector<WrittenMessage> messages;
  for (int i = 0; i < 4; ++i) {
    const int64_t stamp = kStart + i * kStep;
    const std::string pixels = {static_cast<char>(10 * i), static_cast<char>(10 * i + 1)};
    messages.push_back({"/image", "sensor_msgs/Image", stamp + 8'000'000,
                        ImageData(has_stamps ? stamp : 0, "mono8", pixels)});
    if (i % 2 == 0)
      messages.push_back({"/depth", "sensor_msgs/Image", stamp + 9'000'000,
                          ImageData(stamp + 10'000'000, "16UC1",
                                    Bytes(static_cast<uint16_t>(1000 + i)) + Bytes(uint16_t{0}))});
  }
  return folder.Write("a.mcap", Mcap(messages, 3, "lz4"));
}

TEST(RecordedImages, ComeWithTheirHeadersTimes) {
  const TempFolder folder;
  const std::string path = Recording(folder);
  const auto source = OpenImages(path, {.from = 1, .to = 3});
  EXPECT_EQ(source->size(), 2);
  const auto first = source->Next(), second = source->Next();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->index, 1);
  EXPECT_EQ(first->name, "000001");
  EXPECT_NEAR(first->timestamp, 1.7e9 + 0.05, 1e-6);
  EXPECT_EQ(second->image.at<uint8_t>(0, 1), 21);
  EXPECT_FALSE(source->Next());
  EXPECT_THAT(NamesOfImages(path, {}), ElementsAre("000000", "000001", "000002", "000003"));
  EXPECT_EQ(TimesOfImages(path, {}).at(1).timestamp, first->timestamp);
  EXPECT_FALSE(ListImages(path, {}));
  EXPECT_EQ(OpenImages(path, {.color = true})->Next()->image.channels(), 3);
  EXPECT_NEAR(OpenImages(path, {.fps = 10, .from = 2})->Next()->timestamp, 0.2, 1e-9);
}

TEST(RecordedImages, WithoutStampsHaveThoseOfTheRecords) {
  const TempFolder folder;
  const std::string path = Recording(folder, false);
  EXPECT_NEAR(OpenImages(path, {})->Next()->timestamp, 1.7e9 + 0.008, 1e-6);
}

TEST(RecordedImages, RefuseOptionsThatDoNotFit) {
  const TempFolder folder;
  const std::string path = Recording(folder);
  EXPECT_THROW(OpenImages(path, {.from = 4}), InputError);
  EXPECT_THROW(OpenImages(path, {.time_unit = 1e-9}), InputError);
  EXPECT_THROW(OpenImages(path, {.topic = "/depth"}), InputError);
  EXPECT_THROW(OpenImages(folder.Write("a.txt", "1 a.png\n"), {.topic = "/image"}), InputError);
}

TEST(RecordedDepths, BelongToTheNearestImage) {
  const TempFolder folder;
  const std::string path = Recording(folder);
  DepthSource depths(DepthFiles{.path = path, .files = {}, .topic = "/depth"},
                     TimesOfImages(path, {}));
  const auto first = depths.Find("000000");
  ASSERT_TRUE(first);
  EXPECT_EQ(first->image.at<uint16_t>(0, 0), 1000);
  EXPECT_EQ(first->unit, 0.001);
  EXPECT_FALSE(depths.Find("000001"));  // 40 ms away on both sides
  EXPECT_EQ(depths.Find("000002")->image.at<uint16_t>(0, 0), 1002);
  EXPECT_FALSE(depths.Find("000003"));
  EXPECT_THROW(DepthSource(DepthFiles{.path = path, .files = {}, .topic = "/depth"}, {{5.0, "a"}}),
               InputError);
}

}  // namespace
}  // namespace oaslam
