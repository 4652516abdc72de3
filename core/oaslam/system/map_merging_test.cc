#include "oaslam/system/map_merging.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>

#include "matchers.h"
#include "oaslam/error.h"
#include "oaslam/map/joining.h"
#include "oaslam/map/renumbering.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr auto kBoth = RelocalizationMode::kPointsAndObjects;

// A map by a camera on a part of the arc, in a frame and a unit of its own.
SavedMap MapOf(synthetic::World world, double first_deg, double last_deg,
               const Similarity& own_from_world, uint64_t seed) {
  constexpr int kCameras = 10;
  world.cam_from_world.clear();
  for (int k = 0; k < kCameras; ++k)
    world.cam_from_world.push_back(
        synthetic::PoseOnArc({}, first_deg + (last_deg - first_deg) * k / (kCameras - 1)));
  const Map map = synthetic::MakeMap(world, {.seed = seed}).map;
  SavedMap saved;
  saved.map.cameras = map.cameras;
  JoinMap(map, own_from_world, saved.map);
  return saved;
}

class MapMergingTest : public testing::Test {
 protected:
  const synthetic::World room_ = synthetic::MakeWorld({.points = 800, .seed = 1});
  const Similarity there_{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d(1, 2, 3).normalized())),
      {3, -1, 2}};
  const SavedMap a_ = MapOf(room_, -30, 5, Similarity(), 2), b_ = MapOf(room_, -5, 30, there_, 3);
};

TEST_F(MapMergingTest, TwoMapsOfOneRoomBecomeOne) {
  const MapMerging merging = MergeMaps(a_, b_, kBoth, SlamConfig::Offline());
  ASSERT_TRUE(merging.merged) << merging.evidence;
  EXPECT_THAT(merging.evidence, HasSubstr("keyframes of the second map are found in the first"));
  const Map& map = merging.merged->map;
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  ASSERT_EQ(map.keyframes.size(), 20U);
  std::vector<Rigid3> truth;
  for (const double first : {-30, -5})
    for (int k = 0; k < 10; ++k) truth.push_back(synthetic::PoseOnArc({}, first + 35.0 * k / 9));
  EXPECT_LT(CenterErrorsOf(synthetic::KeyframePoses(map), truth, true).worst, 0.01);
  // Landmarks of both are one, where keyframes of both see them.
  EXPECT_LT(10 * map.landmarks.size(), 9 * (a_.map.landmarks.size() + b_.map.landmarks.size()));
  std::set<int> frames;
  for (const FramePose& pose : merging.merged->trajectory)
    EXPECT_TRUE(frames.insert(pose.frame_index).second);
  EXPECT_EQ(frames.size(), 20U);
}

TEST_F(MapMergingTest, IsTheSameOnEveryRun) {
  const MapMerging first = MergeMaps(a_, b_, kBoth, SlamConfig::Offline()),
                   second = MergeMaps(a_, b_, kBoth, SlamConfig::Offline());
  ASSERT_TRUE(first.merged && second.merged);
  for (const KeyframeId id : first.merged->map.keyframes.Ids())
    EXPECT_EQ(first.merged->map.keyframes.At(id).cam_from_world.translation,
              second.merged->map.keyframes.At(id).cam_from_world.translation);
}

TEST_F(MapMergingTest, TheMetreOfEitherIsTheUnit) {
  SavedMap metric = b_;
  metric.map.is_metric = true;
  const MapMerging merging = MergeMaps(a_, metric, kBoth, SlamConfig::Offline());
  ASSERT_TRUE(merging.merged);
  const Map& map = merging.merged->map;
  EXPECT_TRUE(map.is_metric);
  const std::vector<Rigid3> poses = synthetic::KeyframePoses(map);
  const double true_way =
      CenterDistance(synthetic::PoseOnArc({}, -30), synthetic::PoseOnArc({}, 5));
  EXPECT_NEAR(CenterDistance(poses[0], poses[9]), 2.5 * true_way, 0.02 * 2.5 * true_way);
}

TEST_F(MapMergingTest, TheMetreThatIsKnownBestIsTheUnit) {
  const UnitEvidence rough{.relative_sigma = .1, .objects = 4, .classes = 3},
      good{.relative_sigma = .06, .objects = 11, .classes = 7};
  const auto unit_of = [&](std::optional<UnitEvidence> of_a, std::optional<UnitEvidence> of_b) {
    SavedMap a = a_, b = b_;
    a.map.is_metric = b.map.is_metric = true;
    a.map.unit_evidence = of_a;
    b.map.unit_evidence = of_b;
    return MergeMaps(a, b, kBoth, SlamConfig::Offline()).merged->map.unit_evidence;
  };
  EXPECT_EQ(unit_of(rough, good), good);
  EXPECT_EQ(unit_of(good, rough), good);
  EXPECT_EQ(unit_of(good, std::nullopt), std::nullopt);
}

TEST_F(MapMergingTest, TwoRoomsStayApart) {
  const SavedMap elsewhere =
      MapOf(synthetic::MakeWorld({.points = 800, .seed = 9}), -30, 5, there_, 3);
  const MapMerging merging = MergeMaps(a_, elsewhere, kBoth, SlamConfig::Offline());
  EXPECT_FALSE(merging.merged);
  EXPECT_THAT(merging.evidence, HasSubstr("0 of 10 keyframes"));
}

TEST_F(MapMergingTest, SubmapsOfBothStayApartTheLargestFirst) {
  SavedMap a = a_, b = b_;
  a.submaps.push_back({MapOf(synthetic::MakeWorld({.seed = 5}), -30, 5, Similarity(), 4).map, {}});
  b.submaps.push_back(a.submaps[0]);
  for (const uint32_t id : {7, 8, 9}) a.submaps[0].map.RetireKeyframe(KeyframeId(id));
  for (Submap* submap : {&a.submaps[0], &b.submaps[0]})
    *submap = Renumbered(*submap, {{100, 10000, 100}, 500, submap->map.cameras, {0}});
  const MapMerging merging = MergeMaps(a, b, kBoth, SlamConfig::Offline());
  ASSERT_TRUE(merging.merged);
  const std::vector<Submap>& submaps = merging.merged->submaps;
  ASSERT_EQ(submaps.size(), 2U);
  EXPECT_EQ(submaps[0].map.keyframes.size(), 10U);
  EXPECT_EQ(submaps[1].map.keyframes.size(), 7U);
  EXPECT_FALSE(submaps[0].map.keyframes.Contains(submaps[1].map.keyframes.Ids()[0]));
}

TEST_F(MapMergingTest, ContradictingClassesAreRefused) {
  SavedMap a = a_, b = b_;
  a.map.classes.whole_of = {{1, 2}};
  b.map.classes.whole_of = {{2, 1}};
  EXPECT_THROW(MergeMaps(a, b, kBoth, SlamConfig::Offline()), InputError);
}

TEST_F(MapMergingTest, CamerasAndNamesOfBothAreKept) {
  SavedMap a = a_, b = b_;
  a.class_names = {{41, "cup"}};
  b.class_names = {{41, "cup"}, {100, "statue"}};
  b.map.cameras[0].name = "phone";
  const MapMerging merging = MergeMaps(a, b, kBoth, SlamConfig::Offline());
  ASSERT_TRUE(merging.merged);
  EXPECT_EQ(merging.merged->class_names.size(), 2U);
  ASSERT_EQ(merging.merged->map.cameras.size(), 2U);
  EXPECT_EQ(merging.merged->map.keyframes.At(KeyframeId(15)).camera, 1);
  b.class_names[41] = "mug";
  EXPECT_THROW(MergeMaps(a, b, kBoth, SlamConfig::Offline()), InputError);
}

}  // namespace
}  // namespace oaslam
