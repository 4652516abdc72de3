#include "oaslam/relocalization/relocalizer.h"

#include <gtest/gtest.h>

#include <climits>
#include <numeric>

#include "matchers.h"
#include "object_film.h"

namespace oaslam {
namespace {

Frame FrameOf(const synthetic::World& world, const Rigid3& cam_from_world) {
  Rng rng(11);
  return MakeFrame(synthetic::MakeView(world, cam_from_world, {}, rng));
}

Relocalization FindByPoints(Relocalizer& relocalizer, const Frame& frame, const Map& map) {
  Rng rng(5);
  return relocalizer.Find(frame, map, RelocalizationMode::kPoints, rng);
}

// A map with objects of different classes on a table.
Map MappedTable() {
  Rng rng(4);
  Map map = synthetic::EmptyMap();
  map.up = Eigen::Vector3d::UnitZ();
  for (uint32_t k = 0; k < 10; ++k)
    map.keyframes.Insert(KeyframeId(k), synthetic::BlankKeyframe(synthetic::OnCircle(0.1 * k)));
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d center{rng.Uniform(-0.6, 0.6), rng.Uniform(-0.5, 0.5), 0.1};
    synthetic::AddObject(
        map, WellMappedObject(synthetic::Upright(i, center, {0.05 + 0.01 * i, 0.08, 0.1})));
  }
  return map;
}

Frame FrameOfObjects(const Map& map, const Rigid3& cam_from_world, uint64_t seed) {
  Rng rng(seed);
  Frame frame;
  frame.camera = std::make_shared<const Camera>(map.cameras[0]);
  frame.detections =
      synthetic::Detect(synthetic::ObjectsOf(map), cam_from_world, map.cameras[0], {}, rng);
  return frame;
}

// A map of another place may have the same version, for example if the two are from files.
TEST(Relocalizer, IsNotMisledByAnotherMapOfTheSameVersion) {
  const synthetic::World here = synthetic::MakeWorld({.seed = 1}),
                         there = synthetic::MakeWorld({.seed = 2});
  const Map map_here = synthetic::MakeMap(here, {}).map,
            map_there = synthetic::MakeMap(there, {}).map;
  ASSERT_EQ(map_here.version, map_there.version);
  const Rigid3 pose = synthetic::PoseOnArc({}, 3);
  Relocalizer relocalizer{SlamConfig::Offline()};
  EXPECT_EQ(FindByPoints(relocalizer, FrameOf(here, pose), synthetic::EmptyMap()).evidence,
            PoseEvidence::kNone);
  EXPECT_EQ(FindByPoints(relocalizer, FrameOf(here, pose), map_here).evidence,
            PoseEvidence::kPoints);
  const Relocalization found = FindByPoints(relocalizer, FrameOf(there, pose), map_there);
  ASSERT_EQ(found.evidence, PoseEvidence::kPoints) << found.why_not;
  EXPECT_LT(CenterDistance(found.cam_from_world, pose), 0.05);
  EXPECT_EQ(FindByPoints(relocalizer, FrameOf(there, pose), map_here).evidence,
            PoseEvidence::kNone);
}

TEST(Relocalizer, FindsWhatTheMapHasGrownBy) {
  const synthetic::World world = synthetic::MakeWorld({});
  const Map whole = synthetic::MakeMap(world, {}).map;
  Map map = whole;
  for (const LandmarkId id : map.landmarks.Ids())
    if (id.value % 2 == 0) map.EraseLandmark(id);
  const Frame frame = FrameOf(world, synthetic::PoseOnArc({}, 3));
  Relocalizer relocalizer{SlamConfig::Offline()};
  const int half = FindByPoints(relocalizer, frame, map).points.inliers;
  const int all = FindByPoints(relocalizer, frame, whole).points.inliers;
  EXPECT_GT(half, 50);
  EXPECT_GT(all, 1.5 * half);
}

TEST(Relocalizer, SaysWhyNotInEveryMode) {
  const synthetic::World world = synthetic::MakeWorld({.seed = 1}),
                         other = synthetic::MakeWorld({.seed = 2});
  const Map map = synthetic::MakeMap(world, {}).map;
  Frame frame = FrameOf(other, synthetic::PoseOnArc({}, 3));
  Relocalizer relocalizer{SlamConfig::Offline()};
  const auto why_not = [&](RelocalizationMode mode) {
    Rng rng(5);
    const Relocalization found = relocalizer.Find(frame, map, mode, rng);
    EXPECT_EQ(found.evidence, PoseEvidence::kNone);
    return found.why_not;
  };
  EXPECT_THAT(why_not(RelocalizationMode::kPoints), HasSubstr("place"));
  EXPECT_THAT(why_not(RelocalizationMode::kObjects), HasSubstr("detections"));
  EXPECT_THAT(why_not(RelocalizationMode::kPointsAndObjects), HasSubstr("place"));
  frame.detections.push_back({5, 0.8, {100, 100, 200, 200}, 0});
  EXPECT_THAT(why_not(RelocalizationMode::kPointsAndObjects),
              AllOf(HasSubstr("place"), HasSubstr("detections")));
  frame.features = nullptr;
  EXPECT_THAT(why_not(RelocalizationMode::kPointsAndObjects),
              AllOf(Not(HasSubstr("place")), HasSubstr("detections")));
  EXPECT_EQ(why_not(RelocalizationMode::kPoints), "");
}

TEST(Relocalizer, SureObjectsComeFirstAndPointsConfirmThem) {
  const synthetic::World world = synthetic::MakeWorld({.seed = 1}),
                         other = synthetic::MakeWorld({.seed = 2});
  Map map = synthetic::MakeMap(world, {}).map;
  for (int i = 0; i < 10; ++i)
    synthetic::AddObject(map, WellMappedObject(synthetic::Upright(i, world.points[20 * i],
                                                                  {0.1 + 0.02 * i, 0.2, 0.15})));
  const Rigid3 pose = synthetic::PoseOnArc({}, 3);
  const auto find = [&](const synthetic::World& points, bool with_objects, ObjectMethod method,
                        int keypoints = INT_MAX) {
    Frame frame = FrameOf(points, pose);
    if (keypoints < frame.features->size()) {
      std::vector<uint32_t> some(static_cast<size_t>(keypoints));
      std::iota(some.begin(), some.end(), 0U);
      frame.features = std::make_shared<const Features>(frame.features->Selected(some));
    }
    if (with_objects) frame.detections = FrameOfObjects(map, pose, 1).detections;
    SlamConfig config = SlamConfig::Offline();
    config.relocalization.objects = method;
    Rng rng(5);
    return Relocalizer(config).Find(frame, map, RelocalizationMode::kPointsAndObjects, rng);
  };
  const Relocalization both = find(world, true, ObjectMethod::kRobust);
  EXPECT_EQ(both.evidence, PoseEvidence::kPointsAndObjects) << both.why_not;
  EXPECT_LT(CenterDistance(both.cam_from_world, pose), 0.02);
  EXPECT_EQ(both.candidates_are_by, PoseEvidence::kObjects);
  EXPECT_FALSE(both.objects.matched.empty());
  // In a room that is arranged alike, points that should be there are not; a blurred image has few.
  const Relocalization alike = find(other, true, ObjectMethod::kRobust);
  EXPECT_FALSE(alike.IsFound());
  EXPECT_LE(alike.confidence, 0.5);
  EXPECT_THAT(alike.why_not, HasSubstr("the map shows other points"));
  EXPECT_EQ(find(other, true, ObjectMethod::kRobust, 100).evidence, PoseEvidence::kObjects);
  EXPECT_EQ(find(world, false, ObjectMethod::kRobust).evidence, PoseEvidence::kPoints);
  EXPECT_EQ(find(world, true, ObjectMethod::kPaper).evidence, PoseEvidence::kPoints);
}

TEST(Relocalizer, SaysWhyNotOfAnUnknownCamera) {
  Map map = MappedTable();
  const Frame frame = FrameOfObjects(map, synthetic::OnCircle(0.3), 1);
  map.objects = {};
  Relocalizer relocalizer{SlamConfig::Offline()};
  Rng rng(5);
  Frame raw = frame;
  raw.features = std::make_shared<Features>(*map.keyframes.At(KeyframeId(0)).features);
  EXPECT_THAT(
      relocalizer.FindWithUnknownCamera(raw, map, RelocalizationMode::kObjects, rng).why_not,
      HasSubstr("detections"));
}

// The score of the accepted pose is comparable with those of the other candidates.
TEST(Relocalizer, TheAcceptedPoseLeadsWithAScoreOfItsOwn) {
  const synthetic::World world = synthetic::MakeWorld({});
  const Map map = synthetic::MakeMap(world, {}).map;
  const Frame frame = FrameOf(world, synthetic::PoseOnArc({}, 3));
  Relocalizer relocalizer{SlamConfig::Offline()};
  const Relocalization by_points = FindByPoints(relocalizer, frame, map);
  ASSERT_EQ(by_points.evidence, PoseEvidence::kPoints);
  EXPECT_EQ(by_points.candidates.front().score, by_points.points.inliers);
  EXPECT_EQ(by_points.candidates.front().cam_from_world.translation,
            by_points.cam_from_world.translation);

  const Map table = MappedTable();
  int accepted = 0;
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const Rigid3 pose = synthetic::OnCircle(0.2 + 0.1 * static_cast<double>(seed));
    Rng rng(seed);
    const Relocalization found = relocalizer.Find(FrameOfObjects(table, pose, seed), table,
                                                  RelocalizationMode::kObjects, rng);
    if (found.evidence != PoseEvidence::kObjects) continue;
    ++accepted;
    EXPECT_EQ(found.candidates.front().score, found.objects.score);
    EXPECT_EQ(found.candidates.front().cam_from_world.translation,
              found.cam_from_world.translation);
    for (size_t i = 1; i < found.candidates.size(); ++i) {
      EXPECT_LE(found.candidates[i].score, found.objects.score);
      EXPECT_GT(CenterDistance(found.candidates[i].cam_from_world, found.cam_from_world), 0);
    }
  }
  EXPECT_GT(accepted, 5);
}

}  // namespace
}  // namespace oaslam
