#include "oaslam/tracking/keyframe_decision.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(KeyframeDecision, ANewViewMakesAKeyframe) {
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({0.33, true, 300, 300, 310}));
  EXPECT_EQ(KeyframeNeed::kWanted, NeedsKeyframe({0.33, true, 200, 200, 310}));
  EXPECT_EQ(KeyframeNeed::kWanted, NeedsKeyframe({0.03, true, 100, 100, 310}));
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({0.03, true, 250, 250, 310}));
}

TEST(KeyframeDecision, TimeAloneMakesAKeyframe) {
  EXPECT_EQ(KeyframeNeed::kWanted, NeedsKeyframe({1, true, 300, 300, 300}));
}

TEST(KeyframeDecision, APoseThatManyMatchesContradictDoesNot) {
  EXPECT_EQ(KeyframeNeed::kWanted, NeedsKeyframe({0.33, true, 140, 100, 310}));
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({0.33, true, 180, 100, 310}));
}

TEST(KeyframeDecision, NeverWhileTheMapperIsBusyOrTrackingIsThin) {
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({1.7, false, 100, 100, 310}));
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({1.7, true, 12, 12, 310}));
}

TEST(KeyframeDecision, AViewThatChangesFastIsUrgentEvenWhileTheMapperIsBusy) {
  EXPECT_EQ(KeyframeNeed::kUrgent, NeedsKeyframe({0.03, false, 110, 100, 310, 200}));
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({0.03, false, 110, 100, 310, 120}));
}

}  // namespace
}  // namespace oaslam
