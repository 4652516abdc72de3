#include "oaslam/images/playback_clock.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(PlaybackClock, ImagesAreDueAtTheSpeedOfTheirTimeStamps) {
  PlaybackClock clock;
  EXPECT_EQ(clock.Due(100, 5), 5);
  EXPECT_EQ(clock.Due(100.5, 5.25), 5.5);
  EXPECT_EQ(clock.Due(100.75, 7), 5.75);  // late
  clock.Delay(3);
  EXPECT_EQ(clock.Due(101, 7), 9);
}

TEST(PlaybackClock, ALongGapIsPlayedAsTwoSeconds) {
  PlaybackClock clock;
  EXPECT_EQ(clock.Due(0, 0), 0);
  EXPECT_EQ(clock.Due(60, 1), 3);
  EXPECT_EQ(clock.Due(61, 3), 4);
}

}  // namespace
}  // namespace oaslam
