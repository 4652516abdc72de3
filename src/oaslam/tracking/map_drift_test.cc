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

}  // namespace
}  // namespace oaslam
