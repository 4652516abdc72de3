#include <gtest/gtest.h>

#include "matchers.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/matching/fusion.h"
#include "oaslam/matching/orientation_check.h"
#include "oaslam/matching/projection_search.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

struct Scene {
  synthetic::World world = synthetic::MakeWorld({});
  synthetic::MappedWorld mapped = synthetic::MakeMap(world, {});
  Rigid3 cam_from_world = synthetic::PoseOnArc({}, 3);
  synthetic::View view;
  std::vector<int> point_of_landmark;

  Scene() {
    Rng rng(9);
    view = synthetic::MakeView(world, cam_from_world, {}, rng);
    point_of_landmark.resize(mapped.map.next_landmark, -1);
    for (size_t i = 0; i < mapped.landmark_of_point.size(); ++i)
      if (mapped.landmark_of_point[i].IsValid())
        point_of_landmark[mapped.landmark_of_point[i].value] = static_cast<int>(i);
  }

  std::vector<ProjectedLandmark> Projected() const {
    std::vector<ProjectedLandmark> projected;
    mapped.map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
      if (const auto p =
              ProjectLandmark(id, landmark, world.camera, cam_from_world, *view.features))
        projected.push_back(*p);
    });
    return projected;
  }

  int CountRight(const LandmarkMatches& matches) const {
    int right = 0;
    for (size_t i = 0; i < matches.landmarks.size(); ++i)
      if (matches.landmarks[i].IsValid())
        right += point_of_landmark[matches.landmarks[i].value] == view.point_of_keypoint[i];
    return right;
  }
};

TEST(ProjectionSearch, FindsLandmarksWhereTheyProject) {
  const Scene s;
  const LandmarkMatches matches =
      SearchByProjection(*s.view.features, s.mapped.map, s.Projected(),
                         std::vector<LandmarkId>(s.view.features->keypoints.size()), {});
  EXPECT_GT(matches.count, 300);
  EXPECT_GT(s.CountRight(matches), 0.98 * matches.count);
}

TEST(ProjectionSearch, KeepsWhatIsTaken) {
  const Scene s;
  std::vector<LandmarkId> taken(s.view.features->keypoints.size());
  taken[5] = LandmarkId(12345);
  EXPECT_EQ(
      SearchByProjection(*s.view.features, s.mapped.map, s.Projected(), taken, {}).landmarks[5],
      LandmarkId(12345));
}

TEST(ProjectionSearch, ALandmarkBehindOrFarOffItsViewingDirectionIsNotProjected) {
  const Scene s;
  const Landmark& landmark = s.mapped.map.landmarks.At(s.mapped.map.landmarks.Ids().front());
  const Rigid3 turned(
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY())),
      Eigen::Vector3d::Zero());
  EXPECT_FALSE(
      ProjectLandmark({}, landmark, s.world.camera, turned * s.cam_from_world, *s.view.features));
  const Rigid3 from_behind = synthetic::LookAt({0, 3, 0.8}, {0, 0, 0});
  EXPECT_FALSE(ProjectLandmark({}, landmark, s.world.camera, from_behind, *s.view.features));
}

TEST(LastFrameSearch, FollowsLandmarksFromAWrongPrediction) {
  const Scene s;
  Rng rng(4);
  const Keyframe& last = s.mapped.map.keyframes.At(KeyframeId(4));
  const LandmarkMatches matches =
      SearchFromLastFrame(*s.view.features, s.world.camera, synthetic::PoseOnArc({}, 2.7),
                          s.mapped.map, *last.features, last.landmarks, 15);
  EXPECT_GT(matches.count, 150);
  EXPECT_GT(s.CountRight(matches), 0.95 * matches.count);
}

TEST(EpipolarMatch, PairsFreeKeypointsOfTheSamePoint) {
  Scene s;
  Map& map = s.mapped.map;
  const std::vector<LandmarkId> in_a = map.keyframes.At(KeyframeId(3)).landmarks,
                                in_b = map.keyframes.At(KeyframeId(5)).landmarks;
  for (const LandmarkId id : map.landmarks.Ids()) map.EraseLandmark(id);
  const KeypointPairs pairs = MatchAlongEpipolarLines(map, map.keyframes.At(KeyframeId(3)),
                                                      map.keyframes.At(KeyframeId(5)));
  int right = 0;
  for (const auto& [i, j] : pairs) right += in_a[i].IsValid() && in_a[i] == in_b[j];
  EXPECT_GT(pairs.size(), 250U);
  EXPECT_GT(right, 0.97 * static_cast<double>(pairs.size()));
}

TEST(Fusion, FindsWhatAKeyframeShowsAndMergesDuplicates) {
  Scene s;
  Map& map = s.mapped.map;
  // Split one landmark in two.
  const LandmarkId whole = [&] {
    for (const LandmarkId id : map.landmarks.Ids())
      if (map.landmarks.At(id).observations.size() >= 6) return id;
    return LandmarkId();
  }();
  const std::vector<Observation> observations = map.landmarks.At(whole).observations;
  const LandmarkId twin = map.AddLandmark(map.landmarks.At(whole).position, KeyframeId(0));
  for (size_t i = 0; i < 3; ++i) {
    map.EraseObservation(whole, observations[i].keyframe);
    map.AddObservation(twin, observations[i].keyframe, observations[i].keypoint);
  }
  map.UpdateLandmark(whole);
  map.UpdateLandmark(twin);
  const KeyframeId target = observations[2].keyframe;
  const auto candidates = FindFusionCandidates(map, target, std::vector{whole}, 3);
  ASSERT_EQ(candidates.size(), 1U);
  EXPECT_EQ(candidates[0].keypoint, observations[2].keypoint);
  ApplyFusion(candidates, target, map);
  EXPECT_NE(map.landmarks.Contains(whole), map.landmarks.Contains(twin));
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
}

TEST(OrientationCheck, DropsWhatTurnsDifferently) {
  std::vector<float> turns(40, 0.5F);
  turns[3] = 2.5F;
  turns[7] = -6.28318F + 0.5F;  // a full turn is none
  const std::vector<char> keep = ConsistentOrientations(turns);
  EXPECT_FALSE(keep[3]);
  EXPECT_TRUE(keep[7]);
  EXPECT_TRUE(keep[0]);
}

}  // namespace
}  // namespace oaslam
