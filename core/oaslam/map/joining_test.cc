#include "oaslam/map/joining.h"

#include <gtest/gtest.h>

#include "matchers.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

// A copy of `map` whose ids are larger than those of another map.
Map WithOtherIds(const Map& map, uint32_t keyframes, uint32_t landmarks) {
  Map moved;
  moved.cameras = map.cameras;
  map.keyframes.ForEach([&](KeyframeId id, Keyframe k) {
    for (LandmarkId& l : k.landmarks)
      if (l.IsValid()) l.value += landmarks;
    for (Covisible& c : k.covisible) c.keyframe.value += keyframes;
    moved.keyframes.Insert(KeyframeId(id.value + keyframes), std::move(k));
  });
  map.landmarks.ForEach([&](LandmarkId id, Landmark l) {
    for (Observation& o : l.observations) o.keyframe.value += keyframes;
    l.first_keyframe.value += keyframes;
    moved.landmarks.Insert(LandmarkId(id.value + landmarks), std::move(l));
  });
  moved.next_landmark = map.next_landmark + landmarks;
  return moved;
}

TEST(JoinMap, CamerasOfBothMapsAreKept) {
  const synthetic::World world = synthetic::MakeWorld({.points = 100, .cameras = 3});
  Map map = synthetic::MakeMap(world, {}).map;
  Map other = WithOtherIds(map, 100, map.next_landmark);
  other.cameras.insert(other.cameras.begin(), Zoomed(world.camera, 1.5));
  other.keyframes.MutableAt(KeyframeId(100)).camera = 0;
  other.keyframes.MutableAt(KeyframeId(101)).camera = 1;
  other.keyframes.MutableAt(KeyframeId(102)).camera = 1;
  Object object;
  object.observations.push_back({0, KeyframeId(101), {}, 0, {0, 0, 10, 10}, 1, 0});
  other.objects.Insert(ObjectId(7), object);
  JoinMap(other, {}, map);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  ASSERT_EQ(map.cameras.size(), 2U);
  EXPECT_EQ(map.cameras[0], world.camera);
  EXPECT_EQ(map.keyframes.At(KeyframeId(0)).camera, 0);
  EXPECT_EQ(map.keyframes.At(KeyframeId(100)).camera, 1);
  EXPECT_EQ(map.keyframes.At(KeyframeId(101)).camera, 0);
  EXPECT_EQ(map.objects.At(ObjectId(7)).observations[0].camera, 1);
}

TEST(JoinMap, WhatCamerasSeeStaysTheSame) {
  const synthetic::World world = synthetic::MakeWorld({.points = 200, .cameras = 4});
  Map map = synthetic::MakeMap(world, {}).map;
  Map other = WithOtherIds(map, 100, map.next_landmark);
  other.RetireKeyframe(KeyframeId(102));
  Object object;
  object.state = ObjectState::kMapped;
  object.ellipsoid.half_axes = {0.1, 0.2, 0.3};
  object.observations.push_back({0,
                                 KeyframeId(102),
                                 Rigid3(Eigen::Quaterniond::Identity(), {0.1, 0, 0}),
                                 0,
                                 {0, 0, 10, 10},
                                 1,
                                 0});
  other.objects.Insert(ObjectId(7), object);
  const Similarity motion(
      1.7, Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 0, 2).normalized())),
      {4, -2, 1});
  const size_t before = map.landmarks.size();
  JoinMap(other, motion, map);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  EXPECT_EQ(map.keyframes.size(), 7U);
  EXPECT_EQ(map.landmarks.size(), before + other.landmarks.size());
  other.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    for (const Observation& o : landmark.observations) {
      const Eigen::Vector2d was = ProjectIdeal(
          world.camera, other.keyframes.At(o.keyframe).cam_from_world * landmark.position);
      const Eigen::Vector2d is =
          ProjectIdeal(world.camera,
                       map.keyframes.At(o.keyframe).cam_from_world * map.landmarks.At(id).position);
      EXPECT_LT((was - is).norm(), 1e-6);
    }
  });
  const auto box_in = [&](const Map& m) {
    const ObjectObservation& o = m.objects.At(ObjectId(7)).observations.front();
    return *ProjectToBox(m.objects.At(ObjectId(7)).ellipsoid,
                         o.cam_from_reference * *m.ResolvePose(o.reference), world.camera);
  };
  EXPECT_NEAR(box_in(map).x1, box_in(other).x1, 1e-6);
  EXPECT_NEAR(box_in(map).y2, box_in(other).y2, 1e-6);
}

TEST(MetreBy, AMapInMetresTellsTheUnitOfTheOther) {
  const Similarity world_from_other(2.5, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero());
  Map map, other;
  EXPECT_FALSE(MetreBy(other, world_from_other, map));
  other.is_metric = true;
  other.unit_evidence = UnitEvidence{0.04, 5, 4};
  const std::optional<Metre> metre = MetreBy(other, world_from_other, map);
  ASSERT_TRUE(metre);
  EXPECT_DOUBLE_EQ(metre->metres_per_unit, 0.4);
  EXPECT_EQ(metre->by_objects, other.unit_evidence);
  map.is_metric = true;
  EXPECT_FALSE(MetreBy(other, world_from_other, map));
}

}  // namespace
}  // namespace oaslam
