#include "oaslam/map/metre.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

// Keyframes along a line, each `step` units behind the one before it.
Map Line(double step, int count) {
  Map map;
  for (int k = 0; k < count; ++k) {
    Keyframe keyframe;
    keyframe.frame_index = k;
    keyframe.cam_from_world.translation.z() = step * k;
    map.keyframes.Insert(KeyframeId(static_cast<uint32_t>(k)), std::move(keyframe));
  }
  return map;
}

void Measure(uint32_t id, double metres, double relative_sigma, Map& map) {
  KeyframeMotion motion;
  motion.from = KeyframeId(id - 1);
  motion.cam_from_cam.translation.z() = -1;
  motion.sigma_position = 0.02;
  motion.metres = metres;
  motion.relative_sigma = relative_sigma;
  map.keyframes.MutableAt(KeyframeId(id)).motion = motion;
}

TEST(MetresPerUnitByMotions, IsThatOfTheMapAsItIsNow) {
  Map map = Line(0.5, 12);
  for (uint32_t id = 1; id < 10; ++id) Measure(id, 1, 0.01, map);
  EXPECT_FALSE(MetresPerUnitByMotions(map)) << "few motions";
  for (uint32_t id = 10; id < 12; ++id) Measure(id, 1, 0.01, map);
  EXPECT_NEAR(MetresPerUnitByMotions(map).value(), 2, 1e-9);
  map.Scale(4);  // as a loop does
  EXPECT_NEAR(MetresPerUnitByMotions(map).value(), 0.5, 1e-9);
}

TEST(MetresPerUnitByMotions, WhatIsKnownBetterCountsMore) {
  Map map = Line(1, 13);
  for (uint32_t id = 1; id < 13; ++id)
    Measure(id, id % 2 == 0 ? 1 : 1.05, id % 2 == 0 ? 0.06 : 0.006, map);
  EXPECT_NEAR(MetresPerUnitByMotions(map).value(), 1.05, 0.001);
}

// A camera that stands moves by the error of its poses.
TEST(MetresPerUnitByMotions, TheErrorOfPosesIsNoMotion) {
  Map map = Line(0.001, 12);
  for (uint32_t id = 1; id < 12; ++id) {
    Measure(id, 0.002, 0.01, map);
    map.keyframes.MutableAt(KeyframeId(id)).motion->cam_from_cam.translation.z() = -0.002;
  }
  EXPECT_FALSE(MetresPerUnitByMotions(map));
}

TEST(SigmaOfMetre, IsKnownByUserAndSensorsAlone) {
  Map map;
  EXPECT_FALSE(SigmaOfMetre(map));
  map.is_metric = true;
  EXPECT_GT(SigmaOfMetre(map).value(), 0);
  map.unit_evidence = UnitEvidence{.05, 4, 3, UnitSource::kObjects};
  EXPECT_FALSE(SigmaOfMetre(map)) << "usual sizes vary";
  map.unit_evidence = UnitEvidence{.012, 0, 0, UnitSource::kImu};
  EXPECT_EQ(SigmaOfMetre(map), .012);
}

}  // namespace
}  // namespace oaslam
