#include "oaslam/tracking/keyframe_decision.h"

#include <gtest/gtest.h>

#include "synthetic_world.h"

namespace oaslam {
namespace {

TEST(NeedsKeyframe, ANewViewMakesAKeyframe) {
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({0.33, true, 300, 300, 310}));
  EXPECT_EQ(KeyframeNeed::kWanted, NeedsKeyframe({0.33, true, 200, 200, 310}));
  EXPECT_EQ(KeyframeNeed::kWanted, NeedsKeyframe({0.03, true, 100, 100, 310}));
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({0.03, true, 250, 250, 310}));
}

TEST(NeedsKeyframe, TimeAloneMakesAKeyframe) {
  EXPECT_EQ(KeyframeNeed::kWanted, NeedsKeyframe({1, true, 300, 300, 300}));
}

TEST(NeedsKeyframe, APoseThatManyMatchesContradictDoesNot) {
  EXPECT_EQ(KeyframeNeed::kWanted, NeedsKeyframe({0.33, true, 140, 100, 310}));
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({0.33, true, 180, 100, 310}));
}

TEST(NeedsKeyframe, NeverWhileTheMapperIsBusyOrTrackingIsThin) {
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({1.7, false, 100, 100, 310}));
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({1.7, true, 12, 12, 310}));
}

TEST(NeedsKeyframe, AViewThatChangesFastIsUrgentEvenWhileTheMapperIsBusy) {
  EXPECT_EQ(KeyframeNeed::kUrgent, NeedsKeyframe({0.03, false, 110, 100, 310, 200}));
  EXPECT_EQ(KeyframeNeed::kNone, NeedsKeyframe({0.03, false, 110, 100, 310, 120}));
}

class KeyframeDecisionTest : public testing::Test {
 protected:
  KeyframeNeed NeedAt(double timestamp, int inliers,
                      TrackingState state = TrackingState::kTracking) const {
    Frame frame;
    frame.timestamp = timestamp;
    frame.motion = synthetic::TrueMotion(20, synthetic::PoseOnArc({}, 5));
    TrackReport tracked;
    tracked.matched = tracked.inliers = inliers;
    tracked.reference = kNewest;
    return maker_.Need(frame, map_, tracked, state, link_);
  }

  static constexpr KeyframeId kNewest{7};
  Map map_ = synthetic::MakeMap(synthetic::MakeWorld({}), {}).map;
  OdometryLink link_;
  KeyframeDecision maker_;
};

TEST_F(KeyframeDecisionTest, AFrameThatSeesLittleOfItsReferenceIsWanted) {
  const int seen = map_.CountTrackedLandmarks(kNewest, 3);
  maker_.Made(kNewest, 0, seen);
  EXPECT_EQ(NeedAt(0.3, seen), KeyframeNeed::kNone);
  EXPECT_NE(NeedAt(0.3, seen / 3), KeyframeNeed::kNone);
}

TEST_F(KeyframeDecisionTest, NoneIsMadeWhileTheMapperWorksOnTheLastOne) {
  const int seen = map_.CountTrackedLandmarks(kNewest, 3);
  maker_.Made(KeyframeId(100), 0, seen / 3);  // not in the map yet
  EXPECT_EQ(NeedAt(0.3, seen / 3), KeyframeNeed::kNone);
}

// Where the motion alone carries the pose on, a keyframe is due when its view has changed.
TEST_F(KeyframeDecisionTest, WithoutLandmarksAChangedViewCounts) {
  Frame begun;
  begun.motion = synthetic::TrueMotion(0, synthetic::PoseOnArc({}, 0));
  link_.Begin(begun, kNewest, 3);
  maker_.Made(kNewest, 0, 100);
  EXPECT_EQ(NeedAt(0.3, 0, TrackingState::kOdometry), KeyframeNeed::kNone);
  Frame changed;
  changed.motion = synthetic::TrueMotion(10, synthetic::PoseOnArc({}, 4));
  maker_.Watch(changed);
  EXPECT_NE(NeedAt(0.3, 0, TrackingState::kOdometry), KeyframeNeed::kNone);
  maker_.Made(kNewest, 0.3, 0);
  EXPECT_EQ(NeedAt(0.6, 0, TrackingState::kOdometry), KeyframeNeed::kNone);
}

}  // namespace
}  // namespace oaslam
