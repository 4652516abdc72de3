#include "oaslam/mapping/local_mapping.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "matchers.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

struct Scene {
  synthetic::World world = synthetic::MakeWorld({.cameras = 10});
  synthetic::MappedWorld mapped = synthetic::MakeMap(world, {});
  Map& map = mapped.map;
};

// As a depth camera gives it to a camera that stands.
TEST(InitialMap, NeedsNoParallaxWhereDepthsWereMeasured) {
  const synthetic::World world = synthetic::MakeWorld({});
  Rng rng(3);
  const Rigid3& pose = world.cam_from_world[2];
  const synthetic::View view = synthetic::MakeView(world, pose, {}, rng);
  InitialMap initial;
  initial.first = {0, 0.0, view.camera, view.features, {}};
  initial.second = {1, 0.1, view.camera, view.features, {}};
  initial.first_id = KeyframeId(4);
  initial.second_id = KeyframeId(5);
  initial.second_from_world = pose;
  initial.is_measured = true;
  for (int i = 0; i < static_cast<int>(view.point_of_keypoint.size()); ++i)
    if (view.point_of_keypoint[i] >= 0)
      initial.points.push_back({i, i, pose * world.points[view.point_of_keypoint[i]]});
  Map map = synthetic::EmptyMap();
  ASSERT_TRUE(InsertInitialMap(initial, map));
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  EXPECT_EQ(static_cast<size_t>(map.landmarks.size()), initial.points.size());
  for (const KeyframeId id : {KeyframeId(4), KeyframeId(5)})
    EXPECT_LT(CenterDistance(map.keyframes.At(id).cam_from_world, pose), 1e-9);
  EXPECT_GT(map.keyframes.At(KeyframeId(5)).motion->sigma_position, 0);
}

TEST(InitialMap, IsRefinedInItsFrameAndUnit) {
  const synthetic::World world = synthetic::MakeWorld({});
  Rng rng(3);
  const synthetic::View first = synthetic::MakeView(world, world.cam_from_world[2], {}, rng);
  const synthetic::View second = synthetic::MakeView(world, world.cam_from_world[3], {}, rng);
  InitialMap initial;
  initial.first = {0, 0.0, first.camera, first.features, {}};
  initial.second = {9, 0.3, second.camera, second.features, {}};
  initial.first_id = KeyframeId(4);
  initial.second_id = KeyframeId(5);
  const Rigid3 motion = world.cam_from_world[3] * world.cam_from_world[2].Inverse();
  initial.second_from_first = Rigid3(motion.rotation, motion.translation.normalized());
  initial.second_from_world = world.cam_from_world[3];
  initial.motion = motion;
  for (int i = 0; i < static_cast<int>(first.point_of_keypoint.size()); ++i)
    for (int j = 0; j < static_cast<int>(second.point_of_keypoint.size()); ++j)
      if (first.point_of_keypoint[i] >= 0 &&
          first.point_of_keypoint[i] == second.point_of_keypoint[j])
        initial.points.push_back(
            {i, j,
             world.cam_from_world[2] * world.points[first.point_of_keypoint[i]] /
                 motion.translation.norm()});
  Map map = synthetic::EmptyMap();
  ASSERT_TRUE(InsertInitialMap(initial, map));
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  const Rigid3 change = map.keyframes.At(KeyframeId(4)).cam_from_world *
                        map.keyframes.At(KeyframeId(5)).cam_from_world.Inverse();
  EXPECT_NEAR(change.translation.norm(), motion.translation.norm(), 1e-9);
  EXPECT_LT(CenterDistance(map.keyframes.At(KeyframeId(5)).cam_from_world, world.cam_from_world[3]),
            1e-9);
  EXPECT_GT(map.landmarks.size(), 250U);
  // The odometry's motion holds the two views together, from now on.
  ASSERT_TRUE(map.keyframes.At(KeyframeId(5)).motion.has_value());
  EXPECT_LT((map.keyframes.At(KeyframeId(5)).motion->cam_from_cam.translation - motion.translation)
                .norm(),
            1e-9);
  const double way = motion.translation.norm();
  EXPECT_LT((change.Inverse().translation - motion.translation).norm(), 0.02 * way);

  initial.points.resize(12);
  Map refused = synthetic::EmptyMap();
  EXPECT_FALSE(InsertInitialMap(initial, refused));
  EXPECT_TRUE(refused.keyframes.empty());
}

// A turn was taken for a way: keyframes and landmarks since then lie wrong.
TEST(CorrectMotions, PutsRightWhatWasMappedByAWrongMotion) {
  Scene s;
  const KeyframeId right(5);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()));
  const Rigid3 wrong(Rigid3::Rotation(turn), Eigen::Vector3d(0.5, 0, 0.2));
  std::vector<std::pair<KeyframeId, KeyframeMotion>> motions;
  for (const KeyframeId id : s.map.keyframes.Ids()) {
    if (id <= right) continue;
    const size_t i = id.value;
    // The odometry has no keyframe there: it moves with the one before.
    if (id != KeyframeId(8))
      motions.push_back(
          {id,
           {KeyframeId(id.value - 1),
            s.world.cam_from_world[i] * s.world.cam_from_world[i - 1].Inverse(), 0.01, 0.01}});
    s.map.keyframes.MutableAt(id).cam_from_world = s.world.cam_from_world[i] * wrong;
  }
  size_t made_wrongly = 0;
  for (const LandmarkId id : s.map.landmarks.Ids()) {
    Landmark& landmark = s.map.landmarks.MutableAt(id);
    if (landmark.observations.front().keyframe <= right) {
      landmark.first_keyframe = right;
      continue;
    }
    landmark.first_keyframe = landmark.observations.front().keyframe;
    landmark.position = wrong.Inverse() * landmark.position;
    ++made_wrongly;
  }
  ASSERT_GT(made_wrongly, 10U);
  const std::vector<LandmarkId> made = CorrectMotions(right, motions, s.map);
  EXPECT_THAT(s.map.CheckInvariants(), IsEmpty());
  EXPECT_LT(CenterErrorsOf(synthetic::KeyframePoses(s.map), s.world.cam_from_world).worst, 1e-6);
  EXPECT_GT(made.size(), made_wrongly / 3);
}

// They replace those that the map has, unless a loop has scaled it since.
TEST(InsertKeyframe, BringsTheMotionsAsTheyAreKnownByNow) {
  for (const int loops : {0, 1}) {
    Scene s;
    const KeyframeId newest(9), fresh(10);
    s.map.keyframes.MutableAt(newest).motion = KeyframeMotion{KeyframeId(8), Rigid3(), 1, 1};
    s.map.loops_closed = loops;
    const Keyframe& last = s.map.keyframes.At(newest);
    KeyframeInsertion insertion{fresh, {}};
    insertion.frame.frame.camera = std::make_shared<const Camera>(s.world.camera);
    insertion.frame.frame.features = last.features;
    insertion.frame.cam_from_world = insertion.frame.cam_from_reference = last.cam_from_world;
    insertion.frame.landmarks.resize(last.landmarks.size());
    insertion.motions = {{newest, KeyframeMotion{KeyframeId(8), Rigid3(), 2, 2}},
                         {fresh, KeyframeMotion{newest, Rigid3(), 3, 3}}};
    InsertKeyframe(insertion, s.map);
    EXPECT_EQ(s.map.keyframes.At(newest).motion->sigma_position, loops == 0 ? 2 : 1);
    EXPECT_EQ(s.map.keyframes.At(fresh).motion.has_value(), loops == 0);
  }
}

TEST(Triangulation, RecoversErasedLandmarks) {
  Scene s;
  for (const LandmarkId id : s.map.landmarks.Ids())
    if (id.value % 2 == 0) s.map.EraseLandmark(id);
  for (const KeyframeId id : s.map.keyframes.Ids()) s.map.UpdateCovisibility(id);
  const size_t before = s.map.landmarks.size();
  const auto created = TriangulateNewLandmarks(KeyframeId(5), s.map);
  EXPECT_GT(created.size(), 120U);
  EXPECT_EQ(s.map.landmarks.size(), before + created.size());
  EXPECT_THAT(s.map.CheckInvariants(), IsEmpty());
  int near = 0;
  for (const LandmarkId id : created) {
    double best = 1e9;
    for (const Eigen::Vector3d& p : s.world.points)
      best = std::min(best, (p - s.map.landmarks.At(id).position).norm());
    near += best < 0.1;
  }
  EXPECT_GT(near, 0.9 * static_cast<double>(created.size()));
}

// As after a fast turn, or in front of a wall without texture.
TEST(Triangulation, KeyframesWithoutAnyLandmarkGetSome) {
  Scene s;
  for (const LandmarkId id : s.map.landmarks.Ids()) s.map.EraseLandmark(id);
  for (const KeyframeId id : s.map.keyframes.Ids()) s.map.UpdateCovisibility(id);
  EXPECT_GT(TriangulateNewLandmarks(KeyframeId(5), s.map).size(), 120U);
}

// Landmarks of the first keyframe with at least five observations.
std::vector<LandmarkId> WellObserved(const Map& map, size_t count) {
  std::vector<LandmarkId> found;
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    if (found.size() < count && landmark.observations.size() >= 5 &&
        landmark.first_keyframe == KeyframeId(0))
      found.push_back(id);
  });
  return found;
}

TEST(Culling, ALandmarkNobodyFindsGoesAndOneThatIsFoundStays) {
  Scene s;
  const std::vector<LandmarkId> recent = WellObserved(s.map, 3);
  ASSERT_EQ(recent.size(), 3U);
  CountLandmarkUse(std::vector<LandmarkUse>{{recent[0], 20, 2}, {recent[1], 20, 15}}, s.map);
  const size_t before = s.map.landmarks.size();
  // After three keyframes a landmark is no longer tested.
  EXPECT_THAT(CullRecentLandmarks(recent, KeyframeId(9), s.map), IsEmpty());
  EXPECT_FALSE(s.map.landmarks.Contains(recent[0]));
  EXPECT_TRUE(s.map.landmarks.Contains(recent[1]));
  EXPECT_TRUE(s.map.landmarks.Contains(recent[2]));
  EXPECT_EQ(s.map.landmarks.size(), before - 1);
  EXPECT_THAT(s.map.CheckInvariants(), IsEmpty());
}

TEST(Culling, ALandmarkOfTwoObservationsHasTwoKeyframesTime) {
  Scene s;
  const LandmarkId id = WellObserved(s.map, 1).at(0);
  while (s.map.landmarks.At(id).observations.size() > 2)
    s.map.EraseObservation(id, s.map.landmarks.At(id).observations.back().keyframe);
  EXPECT_THAT(CullRecentLandmarks(std::vector{id}, KeyframeId(1), s.map), ElementsAre(id));
  EXPECT_TRUE(s.map.landmarks.Contains(id));
  EXPECT_THAT(CullRecentLandmarks(std::vector{id}, KeyframeId(2), s.map), IsEmpty());
  EXPECT_FALSE(s.map.landmarks.Contains(id));
}

TEST(Culling, RedundantKeyframesAreRetired) {
  synthetic::MappedWorld mapped =
      synthetic::MakeMap(synthetic::MakeWorld({.cameras = 14, .arc_deg = 6}), {});
  CullKeyframes(KeyframeId(13), mapped.map);
  EXPECT_LT(mapped.map.keyframes.size(), 12U);
  EXPECT_TRUE(mapped.map.keyframes.Contains(KeyframeId(0)));
  EXPECT_TRUE(mapped.map.keyframes.Contains(KeyframeId(13)));
  EXPECT_THAT(mapped.map.CheckInvariants(), IsEmpty());
  for (uint32_t k = 0; k < 14; ++k) EXPECT_TRUE(mapped.map.ResolvePose(KeyframeId(k)));
}

void Describe(const PointsToDescribe& points, Keyframe& keyframe) {
  Features features = *keyframe.features;
  features.learned = {points.keypoints, std::vector<Descriptor>(points.keypoints.size())};
  keyframe.features = std::make_shared<const Features>(std::move(features));
  keyframe.learned_depths = points.depths;
}

TEST(PointsToDescribe, ALandmarkIsDescribedFromEachSideOnce) {
  synthetic::MappedWorld mapped = synthetic::MakeMap(
      synthetic::MakeWorld({.cameras = 9, .arc_deg = 80}), {.view = {.missed = 0}});
  Map& map = mapped.map;
  const auto landmarks_in = [&](const PointsToDescribe& points, uint32_t keyframe) {
    return std::ranges::count_if(points.keypoints, [&](uint16_t k) {
      return map.keyframes.At(KeyframeId(keyframe)).landmarks[k].IsValid();
    });
  };
  const PointsToDescribe first = FindPointsToDescribe(KeyframeId(0), map);
  EXPECT_TRUE(std::ranges::is_sorted(first.keypoints));
  ASSERT_GT(landmarks_in(first, 0), 100);
  Describe(first, map.keyframes.MutableAt(KeyframeId(0)));
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  // 10 and 40 degrees from there.
  EXPECT_LT(landmarks_in(FindPointsToDescribe(KeyframeId(1), map), 1), landmarks_in(first, 0) / 3);
  EXPECT_GT(landmarks_in(FindPointsToDescribe(KeyframeId(4), map), 4),
            2 * landmarks_in(first, 0) / 3);
}

TEST(PointsToDescribe, KeypointsWithoutALandmarkAreTriangulated) {
  Scene s;
  const KeyframeId id(5);
  Keyframe& keyframe = s.map.keyframes.MutableAt(id);
  std::map<uint16_t, LandmarkId> freed;
  for (uint16_t k = 0; k < keyframe.landmarks.size(); k += 2)
    if (keyframe.landmarks[k].IsValid()) freed[k] = keyframe.landmarks[k];
  std::map<uint16_t, double> depth_of;
  for (const auto& [k, landmark] : freed) {
    depth_of[k] = (keyframe.cam_from_world * s.map.landmarks.At(landmark).position).z();
    s.map.EraseLandmark(landmark);
  }
  const PointsToDescribe points = FindPointsToDescribe(id, s.map);
  ASSERT_EQ(points.depths.size(), points.keypoints.size());
  int found = 0, right = 0;
  for (size_t i = 0; i < points.keypoints.size(); ++i) {
    const bool has_landmark = s.map.keyframes.At(id).landmarks[points.keypoints[i]].IsValid();
    EXPECT_EQ(points.depths[i] == 0, has_landmark);
    if (!depth_of.contains(points.keypoints[i])) continue;
    ++found;
    right += std::abs(points.depths[i] / depth_of[points.keypoints[i]] - 1) < 0.05;
  }
  EXPECT_GT(found, static_cast<int>(freed.size()) / 2);
  EXPECT_GT(right, 0.9 * found);
}

TEST(Fusion, JoinsTheLandmarksOfAKeyframeWithItsNeighbours) {
  Scene s;
  Map& map = s.map;
  // Keyframe 5 loses its landmarks and triangulates duplicates of them.
  for (const LandmarkId id : std::vector(map.keyframes.At(KeyframeId(5)).landmarks))
    if (id.IsValid()) map.EraseObservation(id, KeyframeId(5));
  int twins = 0;
  Rng rng(2);
  synthetic::View view;
  for (int k = 0; k <= 5; ++k)
    view = synthetic::MakeView(s.world, s.world.cam_from_world[k], {}, rng);
  for (uint32_t i = 0; i < view.point_of_keypoint.size(); i += 3) {
    const int point = view.point_of_keypoint[i];
    if (point < 0 || !s.mapped.landmark_of_point[point].IsValid()) continue;
    const Landmark* old = map.landmarks.Find(s.mapped.landmark_of_point[point]);
    if (!old || old->observations.size() < 4) continue;
    const Observation moved = old->observations.front();
    map.EraseObservation(s.mapped.landmark_of_point[point], moved.keyframe);
    synthetic::AddLandmark(map, s.world.points[point], {{KeyframeId(5), i}, moved});
    ++twins;
  }
  ASSERT_GT(twins, 40);
  map.UpdateCovisibility(KeyframeId(5), 1);
  const size_t before = map.landmarks.size();
  FuseLandmarks(KeyframeId(5), map);
  EXPECT_LT(map.landmarks.size(), before - static_cast<size_t>(twins) * 7 / 10);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
}

}  // namespace
}  // namespace oaslam
