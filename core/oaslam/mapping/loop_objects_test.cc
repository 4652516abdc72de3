#include "oaslam/mapping/loop_objects.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/ellipsoid.h"
#include "object_film.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr uint32_t kWayKeyframes = 12;
constexpr double kDrift = 0.3;
constexpr double kSpacing = 0.6;  // of the objects in the row; they are 0.24 wide

// Two passes of the same cameras; the second believes to be kDrift farther to the right.
struct TwoPasses {
  Map map;
  LoopClosure loop;

  TwoPasses() {
    synthetic::World world = synthetic::MakeWorld({.cameras = kWayKeyframes, .arc_deg = 30});
    for (uint32_t k = 0; k < kWayKeyframes; ++k) {
      Rigid3 drifted = world.cam_from_world[k];
      drifted.translation -= drifted.rotation * Eigen::Vector3d(kDrift, 0, 0);
      world.cam_from_world.push_back(drifted);
    }
    map = synthetic::MakeMap(world, {}).map;
    // Nothing but the objects matters here, and nothing may stand in front of them.
    for (const LandmarkId id : map.landmarks.Ids()) map.EraseLandmark(id);
    for (uint32_t k = 0; k < 2 * kWayKeyframes; ++k) {
      std::vector<Covisible>& covisible = map.keyframes.MutableAt(KeyframeId(k)).covisible;
      covisible.clear();
      for (uint32_t other = k / kWayKeyframes * kWayKeyframes;
           other < (k / kWayKeyframes + 1) * kWayKeyframes; ++other)
        if (other != k) covisible.push_back({KeyframeId(other), 50});
    }
    loop.current = KeyframeId(2 * kWayKeyframes - 1);
    loop.old = KeyframeId(kWayKeyframes - 1);
    loop.old_from_current.translation = {-kDrift, 0, 0};
  }

  // Objects in a row, as seen in one of the passes.
  void Add(int first_category, bool in_second, double shift = 0) {
    for (int i = 0; i < 4; ++i) {
      Object object = synthetic::MappedObject(synthetic::Upright(
          first_category + i, {-0.9 + kSpacing * i + shift + (in_second ? kDrift : 0), -0.5, 0},
          {0.12, 0.12, 0.12}));
      for (uint32_t k = in_second ? kWayKeyframes : 0;
           k < (in_second ? 2 * kWayKeyframes : kWayKeyframes); ++k) {
        const Keyframe& keyframe = map.keyframes.At(KeyframeId(k));
        const auto box = ProjectToBox(object.ellipsoid, keyframe.cam_from_world, map.cameras[0]);
        if (box) object.observations.push_back({static_cast<int>(k), KeyframeId(k), {}, 0, *box});
      }
      synthetic::AddObject(map, object);
    }
  }
};

TEST(LoopObjects, TheSameThingsAgree) {
  TwoPasses passes;
  passes.Add(1, false);
  passes.Add(1, true);
  const LoopObjects objects = CompareObjects(passes.map, passes.loop);
  EXPECT_EQ(objects.agreeing, 8);  // four of each end
  EXPECT_EQ(objects.contradicting, 0);
  EXPECT_FALSE(AreObjectsAgainst(objects));
}

TEST(LoopObjects, OtherThingsBetweenTheirPlacesContradict) {
  TwoPasses passes;
  passes.Add(1, false);
  passes.Add(20, true, kSpacing / 2);
  const LoopObjects objects = CompareObjects(passes.map, passes.loop);
  EXPECT_EQ(objects.agreeing, 0);
  EXPECT_EQ(objects.contradicting, 8);  // four of each end
  EXPECT_TRUE(AreObjectsAgainst(objects));
}

TEST(LoopObjects, AWallInFrontOfAThingExcusesThatItIsNotSeen) {
  TwoPasses passes;
  passes.Add(1, false);
  passes.Add(20, true, kSpacing / 2);
  constexpr double kDepth = 1.2;  // of landmarks on a plane, less than half way to the objects
  for (const KeyframeId id : passes.map.keyframes.Ids()) {
    const Keyframe& keyframe = passes.map.keyframes.At(id);
    const Features& features = *keyframe.features;
    for (uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const Eigen::Vector2d px = features.keypoints[i].px.cast<double>();
      const Eigen::Vector3d in_cam = kDepth * RayOf(passes.map.cameras[0], px);
      const LandmarkId landmark =
          passes.map.AddLandmark(keyframe.cam_from_world.Inverse() * in_cam, id);
      passes.map.AddObservation(landmark, id, i);
    }
  }
  EXPECT_FALSE(AreObjectsAgainst(CompareObjects(passes.map, passes.loop)));
}

TEST(LoopObjects, WithoutObjectsNothingIsSaid) {
  const TwoPasses passes;
  const LoopObjects objects = CompareObjects(passes.map, passes.loop);
  EXPECT_EQ(objects.agreeing + objects.contradicting, 0);
  EXPECT_FALSE(AreObjectsAgainst(objects));
}

}  // namespace
}  // namespace oaslam
