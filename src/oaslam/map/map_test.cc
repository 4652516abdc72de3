#include "oaslam/map/map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oaslam {
namespace {

using testing::IsEmpty;

Keyframe MakeKeyframe(int keypoints, double x) {
  auto features = std::make_shared<Features>();
  features->bounds = {0, 0, 640, 480};
  features->keypoints.resize(keypoints);
  features->descriptors.resize(keypoints);
  features->BuildGrid();
  Keyframe keyframe;
  keyframe.cam_from_world.translation = {-x, 0, 0};
  keyframe.features = features;
  keyframe.landmarks.resize(keypoints);
  return keyframe;
}

Map ThreeKeyframes() {
  Map map;
  map.cameras.push_back({.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240});
  for (uint32_t k = 0; k < 3; ++k) map.keyframes.Insert(KeyframeId(k), MakeKeyframe(40, k));
  for (uint32_t i = 0; i < 20; ++i) {
    const LandmarkId id = map.AddLandmark({0.1 * i, 0, 5}, KeyframeId(0));
    for (uint32_t k = 0; k < 3; ++k) map.AddObservation(id, KeyframeId(k), i);
    map.UpdateLandmark(id);
  }
  for (uint32_t k = 0; k < 3; ++k) map.UpdateCovisibility(KeyframeId(k), 15);
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
  map.UpdateCovisibility(KeyframeId(1), 15);
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
  object.observations.front().anchor = KeyframeId(0);
  object.observations.front().cam_from_anchor.translation = {1, 0, 0};
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
  EXPECT_DOUBLE_EQ(scaled.observations.front().cam_from_anchor.translation.x(), 2.5);
}

TEST(Map, InvariantsCanFail) {
  Map map = ThreeKeyframes();
  map.keyframes.MutableAt(KeyframeId(1)).landmarks[0] = LandmarkId();
  EXPECT_FALSE(map.CheckInvariants().empty());
}

}  // namespace
}  // namespace oaslam
