#include "oaslam/bundle/bundle_adjustment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "synthetic_world.h"

namespace oaslam {
namespace {

using synthetic::MapOptions;
using synthetic::WorldOptions;

struct Errors {
  double centers = 0, points = 0;  // RMS
};

Errors ErrorsOf(const Map& map, const synthetic::World& world, const std::vector<LandmarkId>& landmark_of_point) {
  Errors e;
  int centers = 0, points = 0;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    e.centers += (keyframe.cam_from_world.OriginInSource() - world.cam_from_world[id.value].OriginInSource()).squaredNorm();
    ++centers;
  });
  for (size_t i = 0; i < landmark_of_point.size(); ++i)
    if (const Landmark* landmark = map.landmarks.Find(landmark_of_point[i])) {
      e.points += (landmark->position - world.points[i]).squaredNorm();
      ++points;
    }
  return {std::sqrt(e.centers / centers), std::sqrt(e.points / points)};
}

TEST(BundleAdjustment, GlobalRecoversADisturbedWorld) {
  const synthetic::World world = synthetic::MakeWorld(WorldOptions{.points = 300, .cameras = 6});
  MapOptions options{.position_noise = 0.05, .translation_noise = 0.03, .rotation_noise_rad = 0.01};
  options.view.noise_px = 0.3;
  auto [map, landmarks] = synthetic::MakeMap(world, options);
  const Errors before = ErrorsOf(map, world, landmarks);
  const BundleCorrection correction = GlobalBundleAdjustment(map, 20);
  ASSERT_TRUE(correction.success);
  EXPECT_LT(correction.final_cost, 0.01 * correction.initial_cost);
  EXPECT_EQ(correction.poses.size(), 5U);  // the first stays
  ApplyCorrection(correction, map);
  EXPECT_THAT(map.CheckInvariants(), testing::IsEmpty());
  const Errors after = ErrorsOf(map, world, landmarks);
  EXPECT_LT(after.centers, 0.3 * before.centers);  // what is left is mostly scale, which nothing fixes
  EXPECT_LT(after.points, 0.3 * before.points);
}

TEST(BundleAdjustment, LocalIsHeldByFixedObservers) {
  const synthetic::World world = synthetic::MakeWorld(WorldOptions{.points = 400, .cameras = 10});
  auto [map, landmarks] = synthetic::MakeMap(world, MapOptions{});
  Rng rng(3);
  for (const uint32_t k : {7U, 8U, 9U}) {
    Keyframe& keyframe = map.keyframes.MutableAt(KeyframeId(k));
    keyframe.cam_from_world = synthetic::Disturb(keyframe.cam_from_world, 0.05, 0.02, rng);
  }
  const BundleCorrection correction = LocalBundleAdjustment(map, KeyframeId(9), BundleConfig{.local_iterations = 10, .max_local_keyframes = 4});
  ASSERT_TRUE(correction.success);
  EXPECT_EQ(correction.poses.size(), 4U);
  ApplyCorrection(correction, map);
  for (const auto& [id, pose] : correction.poses)
    EXPECT_LT((pose.OriginInSource() - world.cam_from_world[id.value].OriginInSource()).norm(), 0.01) << id.value;
}

TEST(BundleAdjustment, OutliersAreFoundAndErased) {
  const synthetic::World world = synthetic::MakeWorld(WorldOptions{.points = 300, .cameras = 6});
  auto [map, landmarks] = synthetic::MakeMap(world, MapOptions{});
  // Landmarks far off their place in one view: their key point moves to one of clutter.
  std::vector<std::pair<LandmarkId, KeyframeId>> wrong;
  const KeyframeId keyframe_id(3);
  for (uint32_t i = 0, free = static_cast<uint32_t>(map.keyframes.At(keyframe_id).landmarks.size()) - 1; wrong.size() < 15; ++i) {
    const LandmarkId id = map.keyframes.At(keyframe_id).landmarks[i];
    if (!id.IsValid() || map.landmarks.At(id).observations.size() < 4) continue;
    map.EraseObservation(id, keyframe_id);
    ASSERT_TRUE(map.AddObservation(id, keyframe_id, free--));
    wrong.emplace_back(id, keyframe_id);
  }
  const BundleCorrection correction = LocalBundleAdjustment(map, KeyframeId(5), BundleConfig{});
  ASSERT_TRUE(correction.success);
  EXPECT_THAT(correction.outliers, testing::IsSupersetOf(wrong));
  size_t observations = 0;
  map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) { observations += landmark.observations.size(); });
  EXPECT_LT(correction.outliers.size(), wrong.size() + observations / 10);
  ApplyCorrection(correction, map);
  EXPECT_THAT(map.CheckInvariants(), testing::IsEmpty());
}

TEST(BundleAdjustment, TheSameMapGivesTheSameBits) {
  const synthetic::World world = synthetic::MakeWorld(WorldOptions{.points = 200, .cameras = 5});
  const Map map = synthetic::MakeMap(world, MapOptions{.position_noise = 0.02}).map;
  const BundleCorrection a = LocalBundleAdjustment(map, KeyframeId(4), BundleConfig{});
  const std::vector<char> shift_the_heap(12345);
  const BundleCorrection b = LocalBundleAdjustment(Map(map), KeyframeId(4), BundleConfig{});
  ASSERT_EQ(a.points.size(), b.points.size());
  for (size_t i = 0; i < a.points.size(); ++i) EXPECT_EQ(a.points[i].second, b.points[i].second);
  for (size_t i = 0; i < a.poses.size(); ++i) EXPECT_EQ(a.poses[i].second.translation, b.poses[i].second.translation);
  EXPECT_EQ(a.outliers, b.outliers);
}

TEST(BundleAdjustment, ASingleKeyframeHasNothingToOptimise) {
  const synthetic::World world = synthetic::MakeWorld(WorldOptions{.points = 50, .cameras = 1});
  const Map map = synthetic::MakeMap(world, MapOptions{}).map;
  EXPECT_FALSE(GlobalBundleAdjustment(map, 10).success);
  EXPECT_FALSE(LocalBundleAdjustment(map, KeyframeId(0), BundleConfig{}).success);
  EXPECT_FALSE(GlobalBundleAdjustment(Map(), 10).success);
}

TEST(BundleAdjustment, ACorrectionSkipsWhatIsGone) {
  const synthetic::World world = synthetic::MakeWorld(WorldOptions{.points = 200, .cameras = 5});
  Map map = synthetic::MakeMap(world, MapOptions{.position_noise = 0.02}).map;
  const BundleCorrection correction = GlobalBundleAdjustment(map, 4);
  map.RetireKeyframe(KeyframeId(2));
  map.EraseLandmark(correction.points.front().first);
  ApplyCorrection(correction, map);
  EXPECT_THAT(map.CheckInvariants(), testing::IsEmpty());
}

}  // namespace
}  // namespace oaslam
