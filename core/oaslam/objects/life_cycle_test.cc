#include "oaslam/objects/life_cycle.h"

#include <gtest/gtest.h>

#include <optional>

namespace oaslam {
namespace {

TEST(LifeCycle, WhatWasNeverMappedIsForgottenAfterATimeAndSomeImages) {
  EXPECT_FALSE(IsForgotten({60, 1.9}));
  EXPECT_TRUE(IsForgotten({61, 2.1}));
  EXPECT_FALSE(IsForgotten({3, 3}));  // one image a second
  EXPECT_TRUE(IsForgotten({5, 5}));
}

TEST(LifeCycle, Transitions) {
  ObjectsConfig config;
  config.min_observations = 40;
  const auto next = [&](ObjectState state, bool has_model, double observations, double share,
                        bool is_forgotten) {
    return NextState(state, {has_model, observations, {0.8, share}, is_forgotten}, config);
  };
  EXPECT_EQ(next(ObjectState::kTentative, false, 100, 0, false), ObjectState::kTentative);
  EXPECT_EQ(next(ObjectState::kTentative, false, 100, 0, true), std::nullopt);
  EXPECT_EQ(next(ObjectState::kTentative, true, 12, 1, false), ObjectState::kInitialized);
  EXPECT_EQ(next(ObjectState::kInitialized, true, 39, 1, false), ObjectState::kInitialized);
  EXPECT_EQ(next(ObjectState::kInitialized, true, 40, 0.95, false), ObjectState::kMapped);
  EXPECT_EQ(next(ObjectState::kInitialized, true, 40, 0.85, false), ObjectState::kInitialized);
  EXPECT_EQ(next(ObjectState::kInitialized, true, 39, 1, true), std::nullopt);
  EXPECT_EQ(next(ObjectState::kMapped, true, 400, 0.8, true), ObjectState::kMapped);
  EXPECT_EQ(next(ObjectState::kMapped, true, 400, 0.4, false), ObjectState::kInitialized);
}

TEST(LifeCycle, MeasuredSurfacesNeedAFourthOfTheObservations) {
  const ObjectsConfig config;  // 20
  const auto next = [&](double surfaces) {
    return NextState(ObjectState::kInitialized, {true, 6, {0.8, 1}, false, surfaces}, config);
  };
  EXPECT_EQ(next(0), ObjectState::kInitialized);
  EXPECT_EQ(next(4), ObjectState::kInitialized);
  EXPECT_EQ(next(5), ObjectState::kMapped);
}

TEST(LifeCycle, TheMeanOverlapOfAMappedObjectIsNotBelowTheBound) {
  // Most boxes are cut by the image border and agree with any ellipsoid; the
  // few others do not agree.
  const ObjectsConfig config;
  const ViewOverlap bad{kMinAcceptIoU - 0.02, 0.92};
  const ViewOverlap good{kMinAcceptIoU + 0.02, 0.92};
  EXPECT_EQ(NextState(ObjectState::kInitialized, {true, 274, bad, false}, config),
            ObjectState::kInitialized);
  EXPECT_EQ(NextState(ObjectState::kInitialized, {true, 274, good, false}, config),
            ObjectState::kMapped);
  EXPECT_EQ(NextState(ObjectState::kMapped, {true, 274, bad, false}, config),
            ObjectState::kInitialized);
  EXPECT_EQ(NextState(ObjectState::kMapped, {true, 274, good, false}, config),
            ObjectState::kMapped);
}

}  // namespace
}  // namespace oaslam
