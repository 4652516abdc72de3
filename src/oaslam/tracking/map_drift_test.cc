#include "oaslam/tracking/map_drift.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

// A chain of keyframes with two landmarks each, of which each shares one with the next.
Map Chain(uint32_t count) {
  Map map;
  for (uint32_t k = 0; k < count; ++k) {
    Keyframe keyframe;
    keyframe.landmarks = {LandmarkId(k), LandmarkId(k + 1)};
    if (k > 0) keyframe.covisible.push_back({KeyframeId(k - 1), 1});
    if (k + 1 < count) keyframe.covisible.push_back({KeyframeId(k + 1), 1});
    map.keyframes.Insert(KeyframeId(k), std::move(keyframe));
  }
  return map;
}

TEST(MapDrift, GrowsAlongTheChainOfViews) {
  const Map map = Chain(9);
  MapDrift drift;
  EXPECT_DOUBLE_EQ(drift.LinksTo(map, KeyframeId(0)), 0);
  EXPECT_DOUBLE_EQ(drift.LinksTo(map, KeyframeId(8)), 4);  // eight times half a view
}

TEST(MapDrift, ANewKeyframeIsLinkedToThoseBefore) {
  MapDrift drift;
  EXPECT_DOUBLE_EQ(drift.LinksTo(Chain(4), KeyframeId(3)), 1.5);
  EXPECT_DOUBLE_EQ(drift.LinksTo(Chain(5), KeyframeId(4)), 2);
  EXPECT_DOUBLE_EQ(drift.LinksTo(Chain(9), KeyframeId(8)), 4);  // its neighbours are new, too
}

TEST(MapDrift, ALoopTakesItBack) {
  Map map = Chain(9);
  MapDrift drift;
  EXPECT_DOUBLE_EQ(drift.LinksTo(map, KeyframeId(7)), 3.5);
  map.keyframes.MutableAt(KeyframeId(8)).covisible.push_back({KeyframeId(0), 1});
  map.keyframes.MutableAt(KeyframeId(0)).covisible.push_back({KeyframeId(8), 1});
  ++map.loops_closed;
  EXPECT_DOUBLE_EQ(drift.LinksTo(map, KeyframeId(7)), 1);
}

TEST(MapDrift, WhatSharesNothingIsALinkAway) {
  Map map = Chain(3);
  for (const uint32_t k : {1U, 2U}) map.keyframes.MutableAt(KeyframeId(k)).covisible.clear();
  EXPECT_DOUBLE_EQ(MapDrift().LinksTo(map, KeyframeId(2)), 1.5);
}

// An image that sees what was mapped two images before it.
Parting::Image Seen(double timestamp, int inliers, double agreeing, double links) {
  const int frame = static_cast<int>(std::lround(10 * timestamp));
  return {timestamp, inliers, agreeing, links, frame, frame - 2};
}

TEST(Parting, IsWhereNothingIsSeenForAWhile) {
  Parting parting;
  EXPECT_FALSE(parting.Update(Seen(1.0, 100, 0.98, 2)));
  EXPECT_FALSE(parting.Update(Seen(1.1, 10, 0.98, 2)));
  EXPECT_FALSE(parting.Update(Seen(1.2, 100, 0.98, 2)));
  EXPECT_FALSE(parting.Update(Seen(1.3, 10, 0.98, 2)));
  EXPECT_TRUE(parting.Update(Seen(1.6, 10, 0.98, 3)));
  EXPECT_TRUE(parting.Update(Seen(1.8, 100, 0.98, 4)));
}

TEST(Parting, IsOfWhatIsMappedAfterManyPointsDidNotAgree) {
  Parting parting;
  EXPECT_FALSE(parting.Update(Seen(1.0, 100, 0.9, 2)));
  EXPECT_TRUE(parting.Update(Seen(1.1, 100, 0.5, 2)));
  EXPECT_FALSE(parting.Update(Seen(1.2, 100, 0.98, 2)));  // of what was mapped before
  EXPECT_TRUE(parting.Update(Seen(1.3, 100, 0.98, 2)));
}

// Of a map whose first second was wrong, what follows is right.
TEST(Parting, TheLongerSideLeads) {
  Parting parting;
  EXPECT_TRUE(parting.Update(Seen(1.0, 100, 0.5, 2)));
  EXPECT_TRUE(parting.Update(Seen(2.0, 100, 1, 5)));
  EXPECT_FALSE(parting.Update(Seen(2.1, 100, 1, 5)));
  Parting::Image back = Seen(2.2, 100, 1, 1);
  back.keyframe_frame = 5;
  EXPECT_TRUE(parting.Update(back));
  EXPECT_FALSE(parting.Update(Seen(2.3, 100, 1, 5)));
  EXPECT_TRUE(parting.Update(Seen(2.4, 100, 0.5, 5)));  // parts once more
  EXPECT_TRUE(parting.Update(Seen(2.9, 100, 1, 6)));
  EXPECT_FALSE(parting.Update(Seen(3.0, 100, 1, 1)));  // and is tied
}

TEST(Parting, EndsWhereTheCameraIsBack) {
  Parting parting;
  EXPECT_TRUE(parting.Update(Seen(1.0, 100, 0.5, 2)));
  EXPECT_TRUE(parting.Update(Seen(2.0, 100, 1, 5)));
  EXPECT_FALSE(parting.Update(Seen(3.0, 100, 1, 1)));
  EXPECT_FALSE(parting.Update(Seen(4.0, 100, 1, 5)));
}

}  // namespace
}  // namespace oaslam
