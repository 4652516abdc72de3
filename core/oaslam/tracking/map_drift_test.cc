#include "oaslam/tracking/map_drift.h"

#include <gtest/gtest.h>

#include <cmath>

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

double Links(MapDrift& drift, const Map& map, uint32_t id) {
  return drift.ChainTo(map, KeyframeId(id)).links;
}

TEST(MapDrift, GrowsAlongTheChainOfViewsFromTheMiddle) {
  const Map map = Chain(9);
  MapDrift drift;
  EXPECT_DOUBLE_EQ(Links(drift, map, 0), 2);  // four times half a view
  EXPECT_DOUBLE_EQ(Links(drift, map, 4), 0);
  EXPECT_DOUBLE_EQ(Links(drift, map, 8), 2);
}

TEST(MapDrift, ANewKeyframeIsLinkedToThoseBefore) {
  MapDrift drift;
  EXPECT_DOUBLE_EQ(Links(drift, Chain(4), 3), 0.5);  // from the third
  EXPECT_DOUBLE_EQ(Links(drift, Chain(5), 4), 1);
  EXPECT_DOUBLE_EQ(Links(drift, Chain(9), 8), 2);  // half as many again: from the new middle
}

TEST(MapDrift, ALoopTakesItBack) {
  Map map = Chain(9);
  MapDrift drift;
  EXPECT_DOUBLE_EQ(Links(drift, map, 8), 2);
  map.keyframes.MutableAt(KeyframeId(8)).covisible.push_back({KeyframeId(4), 1});
  map.keyframes.MutableAt(KeyframeId(4)).covisible.push_back({KeyframeId(8), 1});
  ++map.loops_closed;
  EXPECT_DOUBLE_EQ(Links(drift, map, 8), 0.5);
}

TEST(MapDrift, WhatSharesNothingIsALinkAway) {
  Map map = Chain(3);
  for (const uint32_t k : {1U, 2U}) map.keyframes.MutableAt(KeyframeId(k)).covisible.clear();
  MapDrift drift;
  EXPECT_DOUBLE_EQ(Links(drift, map, 0), 1);
  EXPECT_DOUBLE_EQ(Links(drift, map, 2), 1);
}

// Keyframes 1 apart; the odometry loses a tenth of the scale between the sixth and the seventh of
// nine.
TEST(MapDrift, ALostScaleMovesPlacesByTheirDistance) {
  Map map = Chain(9);
  for (uint32_t k = 0; k < 9; ++k) {
    Keyframe& keyframe = map.keyframes.MutableAt(KeyframeId(k));
    keyframe.timestamp = 0.1 * k;
    keyframe.cam_from_world.translation = Eigen::Vector3d(-1.0 * k, 0, 0);
    keyframe.scale_drift = ScaleDrift{0, k < 6 ? 0.0 : 0.01};
  }
  MapDrift drift;
  const auto off = [&](uint32_t id, double x) {
    return std::sqrt(drift.ChainTo(map, KeyframeId(id)).SquaredOffByScale({x, 0, 0}));
  };
  EXPECT_NEAR(off(2, 2), 0, 1e-9);
  EXPECT_NEAR(off(6, 6), 0.1, 1e-9);  // where it was lost, a step away
  EXPECT_NEAR(off(8, 8), 0.3, 1e-9);
  drift.Scale(2);
  EXPECT_NEAR(off(8, 16), 0.6, 1e-9);
  // Another run of the odometry knows nothing: what landmarks tell.
  for (uint32_t k = 6; k < 9; ++k)
    map.keyframes.MutableAt(KeyframeId(k)).scale_drift = ScaleDrift{1, 0.01};
  ++map.loops_closed;
  EXPECT_NEAR(off(8, 8), 3 * 0.15, 1e-9);
}

}  // namespace
}  // namespace oaslam
