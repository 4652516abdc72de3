#include "oaslam/ros2/image_clock.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

using Step = ImageClock::Step;
constexpr int64_t kBegin = 1'700'000'000'000'000'000, kInterval = 33'333'333;

TEST(ImageClock, CountsWhatDidNotArrive) {
  ImageClock clock;
  for (int i = 0; i < 60; ++i) {
    if (i == 20 || i == 40 || i == 41) continue;
    EXPECT_EQ(clock.Add(kBegin + i * kInterval), Step::kNext);
  }
  EXPECT_EQ(clock.missed(), 3);
  // A pause is none, and an image that comes late neither.
  clock.Add(kBegin + 200 * kInterval);
  clock.Add(kBegin + 201 * kInterval + 4 * kInterval / 5);
  for (int i = 202; i < 210; ++i) clock.Add(kBegin + i * kInterval);
  EXPECT_EQ(clock.missed(), 3);
}

TEST(ImageClock, CountsWhereMostAreLost) {
  ImageClock clock;
  for (const int i : {0, 7, 8, 21, 22, 30, 31, 45, 46, 60, 61, 80, 81})
    clock.Add(kBegin + i * kInterval);
  EXPECT_GT(clock.missed(), 30);
}

TEST(ImageClock, CountsNothingWhereImagesAreUneven) {
  ImageClock clock;
  const std::array<int64_t, 5> late = {0, 20, 5, 25, 10};  // milliseconds of 33
  for (size_t i = 0; i < 300; ++i)
    clock.Add(kBegin + static_cast<int64_t>(i) * kInterval + late[i * i % 5] * 1'000'000);
  EXPECT_LT(clock.missed(), 3);
}

TEST(ImageClock, LeavesOutWhatHasNoTime) {
  ImageClock clock;
  EXPECT_EQ(clock.Add(0), Step::kNone);
  EXPECT_EQ(clock.Add(kBegin), Step::kNext);
  EXPECT_EQ(clock.Add(kBegin), Step::kNotNew);
  EXPECT_EQ(clock.Add(kBegin - kInterval), Step::kNotNew);
  EXPECT_EQ(clock.newest(), kBegin);
}

TEST(ImageClock, GoesOnWhereABagBeginsAnew) {
  ImageClock clock;
  std::vector<double> times;
  std::vector<int64_t> stamps;
  for (int pass = 0; pass < 3; ++pass)
    for (int i = 0; i < 90; ++i) {
      const int64_t stamp = kBegin + i * kInterval;
      EXPECT_EQ(clock.Add(stamp), pass > 0 && i == 0 ? Step::kBack : Step::kNext);
      times.push_back(clock.Seconds(stamp));
      stamps.push_back(stamp);
    }
  for (size_t i = 1; i < times.size(); ++i) {
    EXPECT_GT(times[i], times[i - 1]);
    EXPECT_NEAR(static_cast<double>(clock.StampOf(times[i]) - stamps[i]), 0, 500);
  }
  EXPECT_NEAR(times[90] - times[89], 1, 1e-6);
  EXPECT_EQ(clock.missed(), 0);
}

TEST(ImageClock, TellsTimesBeforeTheFirstImage) {
  ImageClock clock;
  clock.Add(kBegin);
  EXPECT_EQ(clock.StampOf(12.5), 12'500'000'000);  // of a map that was loaded
}

}  // namespace
}  // namespace oaslam
