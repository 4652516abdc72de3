#include "oaslam/tracking/keyframe_decision.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(KeyframeDecision, ANewViewMakesAKeyframe) {
  const TrackingConfig config;
  EXPECT_FALSE(NeedsKeyframe({10, true, 300, 300, 310}, config));
  EXPECT_TRUE(NeedsKeyframe({10, true, 200, 200, 310}, config));
  EXPECT_TRUE(NeedsKeyframe({1, true, 100, 100, 310}, config));
  EXPECT_FALSE(NeedsKeyframe({1, true, 250, 250, 310}, config));
}

TEST(KeyframeDecision, TimeAloneMakesAKeyframe) {
  const TrackingConfig config;
  EXPECT_TRUE(NeedsKeyframe({config.max_frames_between_keyframes, true, 300, 300, 300}, config));
}

TEST(KeyframeDecision, APoseThatManyMatchesContradictDoesNot) {
  EXPECT_TRUE(NeedsKeyframe({10, true, 140, 100, 310}, {}));
  EXPECT_FALSE(NeedsKeyframe({10, true, 180, 100, 310}, {}));
}

TEST(KeyframeDecision, NeverWhileTheMapperIsBusyOrTrackingIsThin) {
  const TrackingConfig config;
  EXPECT_FALSE(NeedsKeyframe({50, false, 100, 100, 310}, config));
  EXPECT_FALSE(NeedsKeyframe({50, true, 12, 12, 310}, config));
}

}  // namespace
}  // namespace oaslam
