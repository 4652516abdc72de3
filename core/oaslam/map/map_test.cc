#include "oaslam/map/map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>

#include "matchers.h"
#include "oaslam/map/repair.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

Keyframe KeyframeAt(double x) {
  return synthetic::BlankKeyframe({Rigid3::Rotation::Identity(), {-x, 0, 0}}, 40);
}

Map ThreeKeyframes() {
  Map map = synthetic::EmptyMap();
  for (uint32_t k = 0; k < 3; ++k) map.keyframes.Insert(KeyframeId(k), KeyframeAt(k));
  for (uint32_t i = 0; i < 20; ++i) {
    const LandmarkId id = map.AddLandmark({0.1 * i, 0, 5}, KeyframeId(0));
    for (uint32_t k = 0; k < 3; ++k) map.AddObservation(id, KeyframeId(k), i);
    map.UpdateLandmark(id);
  }
  for (uint32_t k = 0; k < 3; ++k) map.UpdateCovisibility(KeyframeId(k));
  return map;
}

TEST(Map, EditsKeepBothSidesConsistent) {
  Map map = ThreeKeyframes();
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  map.EraseLandmark(LandmarkId(3));
  map.EraseObservation(LandmarkId(4), KeyframeId(1));
  map.EraseObservation(LandmarkId(5), KeyframeId(1));
  map.EraseObservation(LandmarkId(5), KeyframeId(2));
  EXPECT_FALSE(map.landmarks.Contains(LandmarkId(5)));
  EXPECT_TRUE(map.landmarks.Contains(LandmarkId(4)));
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
}

TEST(Map, AKeypointHoldsOneLandmark) {
  Map map = ThreeKeyframes();
  const LandmarkId other = map.AddLandmark({0, 0, 4}, KeyframeId(0));
  EXPECT_FALSE(map.AddObservation(other, KeyframeId(0), 0));
  EXPECT_TRUE(map.AddObservation(other, KeyframeId(0), 30));
  EXPECT_FALSE(map.AddObservation(other, KeyframeId(0), 31));
}

TEST(Map, MergingMovesObservations) {
  Map map = ThreeKeyframes();
  const LandmarkId twin = map.AddLandmark({0, 0, 5}, KeyframeId(0));
  map.EraseObservation(LandmarkId(0), KeyframeId(2));
  map.AddObservation(twin, KeyframeId(2), 0);
  map.AddObservation(twin, KeyframeId(1), 33);
  map.MergeLandmarks(twin, LandmarkId(0));
  EXPECT_FALSE(map.landmarks.Contains(twin));
  EXPECT_EQ(map.landmarks.At(LandmarkId(0)).observations.size(), 3U);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
}

TEST(Map, ARetiredKeyframeStaysResolvable) {
  Map map = ThreeKeyframes();
  const Rigid3 before = map.keyframes.At(KeyframeId(1)).cam_from_world;
  map.RetireKeyframe(KeyframeId(1));
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  ASSERT_TRUE(map.ResolvePose(KeyframeId(1)));
  EXPECT_LT((map.ResolvePose(KeyframeId(1))->translation - before.translation).norm(), 1e-12);
  map.RetireKeyframe(map.retired.At(KeyframeId(1)).parent);
  EXPECT_LT((map.ResolvePose(KeyframeId(1))->translation - before.translation).norm(), 1e-12);
  EXPECT_FALSE(map.ResolvePose(KeyframeId(99)));
}

TEST(Map, CovisibilityCountsSharedLandmarks) {
  Map map = ThreeKeyframes();
  ASSERT_EQ(map.keyframes.At(KeyframeId(0)).covisible.size(), 2U);
  EXPECT_EQ(map.keyframes.At(KeyframeId(0)).covisible[0], (Covisible{KeyframeId(1), 20}));
  for (uint32_t i = 0; i < 10; ++i) map.EraseObservation(LandmarkId(i), KeyframeId(1));
  map.UpdateCovisibility(KeyframeId(1));
  EXPECT_EQ(map.CovisibleKeyframes(KeyframeId(0), 1), std::vector{KeyframeId(2)});
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
}

TEST(Map, ScalingChangesTheUnitAndNothingElse) {
  Map map = ThreeKeyframes();
  map.RetireKeyframe(KeyframeId(1));
  Object object;
  object.ellipsoid.center = {0, 0, 4};
  object.covariance.setOnes();
  object.observations.resize(1);
  object.observations.front().reference = KeyframeId(0);
  object.observations.front().cam_from_reference.translation = {1, 0, 0};
  map.objects.Insert(ObjectId(0), object);
  const Map before = map;
  map.Scale(2.5);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  EXPECT_LT((map.ResolvePose(KeyframeId(1))->translation -
             2.5 * before.ResolvePose(KeyframeId(1))->translation)
                .norm(),
            1e-12);
  const auto in_cam = [](const Map& m) {
    return m.keyframes.At(KeyframeId(2)).cam_from_world * m.landmarks.At(LandmarkId(0)).position;
  };
  EXPECT_LT((in_cam(map) - 2.5 * in_cam(before)).norm(), 1e-12);
  EXPECT_FLOAT_EQ(map.landmarks.At(LandmarkId(0)).max_distance,
                  2.5F * before.landmarks.At(LandmarkId(0)).max_distance);
  const Object& scaled = map.objects.At(ObjectId(0));
  EXPECT_EQ(scaled.ellipsoid.half_axes, 2.5 * object.ellipsoid.half_axes);
  EXPECT_DOUBLE_EQ(scaled.covariance(0, 0), 6.25);
  EXPECT_DOUBLE_EQ(scaled.covariance(0, 5), 2.5);
  EXPECT_DOUBLE_EQ(scaled.covariance(5, 5), 1);
  EXPECT_DOUBLE_EQ(scaled.observations.front().cam_from_reference.translation.x(), 2.5);
}

TEST(Map, InvariantsCanFail) {
  Map map = ThreeKeyframes();
  map.keyframes.MutableAt(KeyframeId(1)).landmarks[0] = LandmarkId();
  EXPECT_FALSE(map.CheckInvariants().empty());
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// With a retired keyframe, an object and an anchor.
Map FullMap() {
  Map map = ThreeKeyframes();
  map.keyframes.Insert(KeyframeId(3), KeyframeAt(3));
  map.RetireKeyframe(KeyframeId(3));
  map.retired.Insert(KeyframeId(4), {KeyframeId(1), {}});
  Object object;
  object.observations = {{0, KeyframeId(0), {}, 0, {1, 1, 9, 9}, 0.5, 0},
                         {9, KeyframeId(4), {}, 0, {1, 1, 9, 9}, 0.5, 0}};
  object.landmarks = {LandmarkId(2), LandmarkId(7)};
  object.landmark_votes = {20, 70};
  map.objects.Insert(ObjectId(0), object);
  Anchor anchor;
  anchor.size = 1;
  anchor.keyframe = KeyframeId(4);
  map.anchors["flag"] = anchor;
  return map;
}

TEST(Map, AConsistentMapIsRepairedToItself) {
  const Map map = FullMap(), repaired = Repaired(map);
  ASSERT_THAT(map.CheckInvariants(), IsEmpty());
  EXPECT_EQ(repaired.keyframes.Ids(), map.keyframes.Ids());
  EXPECT_EQ(repaired.retired.Ids(), map.retired.Ids());
  EXPECT_EQ(repaired.landmarks.Ids(), map.landmarks.Ids());
  EXPECT_EQ(repaired.next_landmark, map.next_landmark);
  EXPECT_EQ(repaired.anchors, map.anchors);
  for (const KeyframeId id : map.keyframes.Ids()) {
    EXPECT_EQ(repaired.keyframes.At(id).landmarks, map.keyframes.At(id).landmarks);
    EXPECT_EQ(repaired.keyframes.At(id).covisible, map.keyframes.At(id).covisible);
  }
  EXPECT_EQ(repaired.objects.At(ObjectId(0)).observations.size(), 2U);
  EXPECT_EQ(repaired.objects.At(ObjectId(0)).landmarks.size(), 2U);
}

// A violated invariant costs only the elements concerned.
TEST(Map, WhatIsBrokenIsLeftOut) {
  const auto expect_repair = [](const char* name, const std::function<void(Map&)>& damage,
                                size_t keyframes, size_t landmarks) {
    Map map = FullMap();
    damage(map);
    EXPECT_THAT(map.CheckInvariants(), Not(IsEmpty())) << name;
    const Map repaired = Repaired(map);
    EXPECT_THAT(repaired.CheckInvariants(), IsEmpty()) << name;
    EXPECT_EQ(repaired.keyframes.size(), keyframes) << name;
    EXPECT_EQ(repaired.landmarks.size(), landmarks) << name;
  };
  const KeyframeId first(0), second(1), retired(4);
  const LandmarkId landmark(3);
  expect_repair(
      "no features", [&](Map& m) { m.keyframes.MutableAt(first).features = nullptr; }, 2, 20);
  expect_repair(
      "no pose",
      [&](Map& m) { m.keyframes.MutableAt(first).cam_from_world.translation.x() = kNan; }, 2, 20);
  expect_repair(
      "no camera", [&](Map& m) { m.keyframes.MutableAt(first).camera = 1; }, 2, 20);
  expect_repair(
      "gone", [&](Map& m) { m.keyframes.Erase(second); }, 2, 20);
  expect_repair(
      "two gone",
      [&](Map& m) {
        m.keyframes.Erase(first);
        m.keyframes.Erase(second);
      },
      1, 0);
  expect_repair(
      "also retired",
      [&](Map& m) {
        m.retired.Insert(second, {first, {}});
      },
      3, 20);
  expect_repair(
      "a circle",
      [&](Map& m) {
        m.retired.MutableAt(retired).parent = KeyframeId(5);
        m.retired.Insert(KeyframeId(5), {retired, {}});
      },
      3, 20);
  expect_repair(
      "one side", [&](Map& m) { m.keyframes.MutableAt(first).landmarks[3] = {}; }, 3, 20);
  expect_repair(
      "other side", [&](Map& m) { m.landmarks.MutableAt(landmark).observations.pop_back(); }, 3,
      20);
  expect_repair(
      "one observation", [&](Map& m) { m.landmarks.MutableAt(landmark).observations.resize(1); }, 3,
      19);
  expect_repair(
      "order", [&](Map& m) { std::ranges::reverse(m.landmarks.MutableAt(landmark).observations); },
      3, 20);
  expect_repair(
      "no position", [&](Map& m) { m.landmarks.MutableAt(landmark).position.y() = kNan; }, 3, 19);
  expect_repair(
      "not allocated", [](Map& m) { m.next_landmark = 5; }, 3, 20);
  expect_repair(
      "erased", [&](Map& m) { m.landmarks.Erase(landmark); }, 3, 19);
  expect_repair(
      "one-sided", [&](Map& m) { m.keyframes.MutableAt(first).covisible.pop_back(); }, 3, 20);
  expect_repair(
      "votes", [](Map& m) { m.objects.MutableAt(ObjectId(0)).landmark_votes.pop_back(); }, 3, 20);
  expect_repair(
      "anchor", [](Map& m) { m.anchors.at("flag").keyframe = KeyframeId(77); }, 3, 20);
  expect_repair(
      "learned", [&](Map& m) { m.keyframes.MutableAt(first).learned_depths.push_back(1); }, 3, 20);
  expect_repair(
      "learned",
      [&](Map& m) {
        Keyframe& keyframe = m.keyframes.MutableAt(first);
        Features features = *keyframe.features;
        features.learned = {{60000}, {Descriptor{}}};
        keyframe.features = std::make_shared<const Features>(std::move(features));
        keyframe.learned_depths = {1};
      },
      3, 20);
  expect_repair(
      "size", [](Map& m) { m.anchors.at("flag").size = -1; }, 3, 20);

  Map map = FullMap();
  Object& object = map.objects.MutableAt(ObjectId(0));
  std::swap(object.landmarks[0], object.landmarks[1]);
  object.observations[1].reference = KeyframeId(99);
  const Object repaired = Repaired(map).objects.At(ObjectId(0));
  EXPECT_EQ(repaired.landmarks, (std::vector{LandmarkId(2), LandmarkId(7)}));
  EXPECT_EQ(repaired.landmark_votes, (std::vector<uint16_t>{70, 20}));
  ASSERT_EQ(repaired.observations.size(), 1U);
  EXPECT_EQ(repaired.observations[0].reference, KeyframeId(0));
}

TEST(Map, DropsKeypointsThatShowNothing) {
  Map map = synthetic::MakeMap(synthetic::MakeWorld({}), {}).map;
  const KeyframeId id(3);
  for (int i = 0; i < map.keyframes.At(id).features->size(); ++i)
    map.keyframes.MutableAt(id).depths.push_back({1.0 + i, 0.01});
  const Keyframe before = map.keyframes.At(id);
  const int shown = map.CountTrackedLandmarks(id, 2);
  ASSERT_LT(shown, before.features->size());
  map.DropFreeKeypoints(id);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  const Keyframe& after = map.keyframes.At(id);
  EXPECT_EQ(after.features->size(), shown);
  EXPECT_EQ(map.CountTrackedLandmarks(id, 2), shown);
  for (const LandmarkId landmark : before.landmarks) {
    if (!landmark.IsValid()) continue;
    const auto was = std::ranges::find(before.landmarks, landmark) - before.landmarks.begin(),
               is = std::ranges::find(after.landmarks, landmark) - after.landmarks.begin();
    EXPECT_EQ(before.features->descriptors[was], after.features->descriptors[is]);
    EXPECT_EQ(before.features->keypoints[was].px, after.features->keypoints[is].px);
    EXPECT_EQ(before.depths[was].z, after.depths[is].z);
  }
}

// Also those that a place is recognised by alone; their depths are lengths of the map.
TEST(Map, KeepsDescribedKeypoints) {
  Map map = synthetic::MakeMap(synthetic::MakeWorld({}), {}).map;
  const KeyframeId id(3);
  Keyframe& keyframe = map.keyframes.MutableAt(id);
  const auto free = static_cast<uint16_t>(std::ranges::find(keyframe.landmarks, LandmarkId()) -
                                          keyframe.landmarks.begin());
  ASSERT_LT(free, keyframe.landmarks.size());
  Features features = *keyframe.features;
  // The second has no depth: its landmark was erased.
  const auto second = static_cast<uint16_t>(
      std::find(keyframe.landmarks.begin() + free + 1, keyframe.landmarks.end(), LandmarkId()) -
      keyframe.landmarks.begin());
  ASSERT_LT(second, keyframe.landmarks.size());
  features.learned = {{free, second}, {Descriptor{1, 2, 3, 4}, Descriptor{}}};
  const Eigen::Vector2f px = features.keypoints[free].px;
  keyframe.features = std::make_shared<const Features>(std::move(features));
  keyframe.learned_depths = {2.5F, 0};
  map.DropFreeKeypoints(id);
  map.Scale(2);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  const Keyframe& after = map.keyframes.At(id);
  ASSERT_EQ(after.features->learned.keypoints.size(), 1U);
  const uint16_t kept = after.features->learned.keypoints[0];
  EXPECT_EQ(after.features->keypoints[kept].px, px);
  EXPECT_EQ(*after.features->learned.Find(kept), (Descriptor{1, 2, 3, 4}));
  EXPECT_EQ(after.features->learned.Find(kept + 1), nullptr);
  EXPECT_EQ(after.learned_depths, std::vector<float>{5});
}

TEST(Map, RetiredKeyframesFormNoChains) {
  Map map = synthetic::MakeMap(synthetic::MakeWorld({}), {}).map;
  std::map<KeyframeId, Rigid3> poses;
  for (const KeyframeId id : map.keyframes.Ids()) poses[id] = map.keyframes.At(id).cam_from_world;
  for (uint32_t k = 1; k < 7; ++k) map.RetireKeyframe(KeyframeId(k));
  for (uint32_t k = 1; k < 7; ++k) {
    EXPECT_TRUE(map.keyframes.Contains(map.retired.At(KeyframeId(k)).parent)) << k;
    const Rigid3 pose = *map.ResolvePose(KeyframeId(k));
    EXPECT_LT((pose.translation - poses[KeyframeId(k)].translation).norm(), 1e-9) << k;
  }
}

}  // namespace
}  // namespace oaslam
