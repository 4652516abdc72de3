#include "oaslam/map/scale_drift.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

Keyframe At(double timestamp, int run, double variance) {
  Keyframe keyframe;
  keyframe.timestamp = timestamp;
  keyframe.scale_drift = ScaleDrift{run, variance};
  return keyframe;
}

TEST(ScaleDrift, IsTheDifferenceBetweenTwoKeyframes) {
  EXPECT_DOUBLE_EQ(*ScaleVarianceByOdometry(At(1, 0, 0.25), At(3, 0, 0.5), 10), 0.25);
  EXPECT_DOUBLE_EQ(*ScaleVarianceByOdometry(At(3, 0, 0.5), At(1, 0, 0.25), 10), 0.25);
}

TEST(ScaleDrift, IsNotKnownAcrossRunsOrLongAfter) {
  EXPECT_FALSE(ScaleVarianceByOdometry(At(1, 0, 0.25), At(3, 1, 0.5), 10));
  EXPECT_FALSE(ScaleVarianceByOdometry(At(1, 0, 0.25), At(30, 0, 0.5), 10));
  EXPECT_FALSE(ScaleVarianceByOdometry(At(1, 0, 0.25), Keyframe(), 10));
}

// A camera that was lost in between may have been put there by a search.
TEST(ScaleDrift, WithoutSharedLandmarksAMotionMustTieThem) {
  const Keyframe first = At(1, 0, 0.25);
  Keyframe second = At(3, 0, 0.5);
  EXPECT_FALSE(ScaleVarianceByOdometry(first, second, 0));
  second.motion.emplace();
  EXPECT_TRUE(ScaleVarianceByOdometry(first, second, 0));
}

TEST(ScaleDrift, IsForgottenBeforeOtherFilms) {
  Map map;
  map.keyframes.Insert(KeyframeId(0), At(1, 0, 0.25));
  ForgetScaleDrift(map);
  EXPECT_FALSE(map.keyframes.At(KeyframeId(0)).scale_drift);
}

}  // namespace
}  // namespace oaslam
