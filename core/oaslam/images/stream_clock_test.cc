#include "oaslam/images/stream_clock.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(StreamClock, TimesAreTheStreamsAndNotThoseOfArrival) {
  StreamClock clock;
  const double delays[] = {0.3, 0.1, 0.5, 0.1};
  for (int i = 0; i < 4; ++i) {
    const StreamClock::Image image = clock.Next(7000 + i / 30.0, 50 + i / 30.0 + delays[i]);
    EXPECT_NEAR(image.timestamp, i / 30.0, 1e-9);
  }
}

TEST(StreamClock, TheAgeIsTheDelayBeyondTheFastestImage) {
  StreamClock clock;
  clock.Next(10.0, 100.3);
  clock.Next(10.1, 100.1 + 0.1);
  const double arrival = 100.2 + 0.6;
  EXPECT_NEAR(arrival - clock.Next(10.2, arrival).taken, 0.5, 1e-9);
}

TEST(StreamClock, ABurstFromABufferKeepsItsTimes) {
  StreamClock clock;  // as HLS begins: seconds of film at once
  for (int i = 0; i < 60; ++i)
    EXPECT_NEAR(clock.Next(i / 30.0, 5.0 + i * 1e-3).timestamp, i / 30.0, 1e-9);
  EXPECT_NEAR(clock.Next(2.0, 5.06).taken, 5.06, 1e-9);  // the newest is not old
}

TEST(StreamClock, WithoutStampsTheArrivalCounts) {
  StreamClock clock;
  EXPECT_EQ(clock.Next(std::nullopt, 20).timestamp, 0);
  const StreamClock::Image image = clock.Next(std::nullopt, 20.25);
  EXPECT_NEAR(image.timestamp, 0.25, 1e-9);
  EXPECT_NEAR(image.taken, 20.25, 1e-9);
}

TEST(StreamClock, AStreamThatBeginsAgainGoesOnInTime) {
  StreamClock clock;
  clock.Next(500, 10);
  clock.Next(501, 11);
  clock.Restart();
  EXPECT_NEAR(clock.Next(0, 15).timestamp, 5, 1e-9);
  EXPECT_NEAR(clock.Next(0.5, 15.7).timestamp, 5.5, 1e-9);
}

TEST(StreamClock, AClockThatIsSetBackOrFarForwardDoesNotMoveTheTimes) {
  StreamClock clock;
  clock.Next(100, 10);
  EXPECT_NEAR(clock.Next(3, 10.1).timestamp, 0.1, 1e-9);
  EXPECT_NEAR(clock.Next(1e9, 10.2).timestamp, 0.2, 1e-6);
}

TEST(StreamClock, TimesAscendWhateverTheStreamSays) {
  StreamClock clock;
  double last = -1;
  for (const double stamp : {1.0, 1.0, 1.0, 0.5, 0.5, 2.0}) {
    const double time = clock.Next(stamp, 10).timestamp;
    EXPECT_GT(time, last);
    last = time;
  }
}

}  // namespace
}  // namespace oaslam
