#include "oaslam/tracking/continuity.h"

#include <gtest/gtest.h>

#include <utility>

#include "synthetic_world.h"

namespace oaslam {
namespace {

// One camera went through two submaps; the second one is placed correctly, or too far away.
TEST(Continuity, ACameraDoesNotJumpBetweenSubmaps) {
  synthetic::World world = synthetic::MakeWorld({});
  const Map map = synthetic::MakeMap(world, {}).map;
  const auto way = [&](int first, int last, double scale) {
    std::vector<FramePose> poses;
    const Rigid3 reference = map.keyframes.At(KeyframeId(0)).cam_from_world;
    for (int i = first; i < last; ++i) {
      Rigid3 pose = synthetic::PoseOnArc({}, -20 + 0.4 * i) * reference.Inverse();
      pose.translation *= scale;
      poses.push_back({i, i / 30.0, KeyframeId(0), pose});
    }
    return poses;
  };
  const std::vector<FramePose> first = way(0, 40, 1), second = way(45, 90, 1);
  EXPECT_TRUE(IsContinuous(map, first, map, second, Similarity()));
  EXPECT_FALSE(IsContinuous(map, first, map, second,
                            Similarity(1, Eigen::Quaterniond::Identity(), {1.5, 0, 0})));
  EXPECT_TRUE(
      IsContinuous(map, first, map, way(90, 120, 1),
                   Similarity(1, Eigen::Quaterniond::Identity(), {1.5, 0, 0})));  // too long after
}

// A window alone tells the place soon after the camera was seen in the map, and never again.
TEST(Continuity, AWindowAloneTellsNoPlaceLater) {
  Map map;
  Rng rng(1);
  Relocalization found;
  found.evidence = PoseEvidence::kPoints;
  for (int i = 0; i < 60; ++i)
    found.points.landmarks.push_back(
        map.AddLandmark({rng.Uniform(-1, 1), rng.Uniform(-1, 1), 3}, KeyframeId(0)));
  for (int i = 0; i < 200; ++i)
    map.AddLandmark({rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(1, 2.7)}, KeyframeId(0));
  EXPECT_TRUE(TellsPlace(map, map, found, 1));
  EXPECT_FALSE(TellsPlace(map, map, found, 10));
  EXPECT_FALSE(TellsPlace(map, map, found, -1));  // of another recording
  Relocalization with_objects = found;
  with_objects.objects.matched.resize(3);
  EXPECT_TRUE(TellsPlace(map, map, with_objects, 10));
  for (uint32_t i = 60; i < 80; ++i) found.points.landmarks.push_back(LandmarkId(i));
  EXPECT_TRUE(TellsPlace(map, map, found, 10));  // with things beside it
}

TEST(Continuity, WhereBothMapsAreOfOneWallThereIsNoOther) {
  Map wall;
  Rng rng(1);
  Keyframe keyframe;
  Relocalization found;
  found.evidence = PoseEvidence::kPoints;
  for (int i = 0; i < 200; ++i) {
    keyframe.landmarks.push_back(
        wall.AddLandmark({rng.Uniform(-1, 1), rng.Uniform(-1, 1), 3}, KeyframeId(0)));
    if (i < 60) found.points.landmarks.push_back(keyframe.landmarks.back());
  }
  wall.keyframes.Insert(KeyframeId(0), std::move(keyframe));
  EXPECT_TRUE(TellsPlace(wall, wall, found, 10));
  Map room = wall;
  for (int i = 0; i < 200; ++i)
    room.AddLandmark({rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(1, 2.7)}, KeyframeId(0));
  EXPECT_FALSE(TellsPlace(wall, room, found, 10));
}

}  // namespace
}  // namespace oaslam
