#include "oaslam/system/atlas.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "matchers.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

Rigid3 TruePose(int frame) { return synthetic::PoseOnArc({}, -20 + 0.4 * frame); }

// Which part of the synthetic world a camera sees.
enum class Scene { kLeft, kRight, kAll, kNothing };

// Two scenes in one place that share no point, as if each were hidden while the other is seen.
class AtlasTest : public testing::Test {
 protected:
  // Frame `index` of a video, taken from the place on the arc of frame `place`.
  Frame View(int index, int place, Scene scene) {
    const synthetic::World& world = scene == Scene::kLeft    ? halves_[0]
                                    : scene == Scene::kRight ? halves_[1]
                                                             : all_;
    const double missed = scene == Scene::kNothing ? 1 : 0.1;
    return MakeFrame(synthetic::MakeView(world, TruePose(place), {.missed = missed}, rng_), index);
  }

  // Images of a walk with an odometry, which a submap needs to begin.
  static constexpr int kBeginning = 30;

  void Walk(Atlas& atlas, int first, int count, int first_place, Scene scene, int step = 1) {
    for (int i = 0; i < count; ++i) {
      places_.resize(static_cast<size_t>(first + i) + 1);
      places_[static_cast<size_t>(first + i)] = first_place + step * i;
      Frame frame = View(first + i, first_place + step * i, scene);
      if (i < kBeginning) {
        // Each walk has an odometry with a frame and a unit of its own.
        Rigid3 motion = TruePose(first_place + step * i) * TruePose(first_place).Inverse();
        motion.translation /= 1 + first / 50.0;
        frame.motion = synthetic::TrueMotion(first + i, motion, first);
      }
      atlas.Process(frame);
    }
  }

  // RMSE of camera centres against the arc, in units of the world.
  double AbsoluteError(const Map& map, const std::vector<FramePose>& trajectory) const {
    std::vector<Rigid3> poses, truth;
    for (const FramePose& pose : trajectory) {
      poses.push_back(pose.cam_from_reference * *map.ResolvePose(pose.reference));
      truth.push_back(TruePose(places_[static_cast<size_t>(pose.frame_index)]));
    }
    return CenterErrorsOf(poses, truth, true).rms;
  }

  static std::set<int> FramesOf(const std::vector<FramePose>& trajectory) {
    std::set<int> frames;
    for (const FramePose& pose : trajectory) frames.insert(pose.frame_index);
    return frames;
  }

  // The camera sees the left scene on its way forth and the right one on its way back.
  std::unique_ptr<Atlas> WalkPastBoth() {
    auto atlas = std::make_unique<Atlas>(SlamConfig::Offline(), map_, false, std::vector<Submap>());
    Walk(*atlas, 0, 70, 0, Scene::kLeft);
    Walk(*atlas, 70, 90, 69, Scene::kRight, -1);
    return atlas;
  }

  const synthetic::World all_ = synthetic::MakeWorld({.points = 1200});
  const std::array<synthetic::World, 2> halves_ = HalvesOf(all_);
  const Map map_ = synthetic::EmptyMap();
  Rng rng_{7};
  std::vector<int> places_;  // by frame
};

TEST_F(AtlasTest, WhatCannotBeJoinedIsKept) {
  const auto atlas = WalkPastBoth();
  atlas->Finish();
  const std::vector<Submap> others = atlas->Others();
  ASSERT_THAT(others, SizeIs(1));
  const Map& main = *atlas->main().snapshot();
  EXPECT_GE(main.keyframes.size(), others[0].map.keyframes.size());
  std::set<int> frames = FramesOf(atlas->main().tracker().trajectory());
  for (const int frame : FramesOf(others[0].trajectory))
    EXPECT_TRUE(frames.insert(frame).second) << frame;
  EXPECT_GT(frames.size(), 130U);
  for (const KeyframeId id : others[0].map.keyframes.Ids())
    EXPECT_FALSE(main.keyframes.Contains(id) || main.retired.Contains(id));
  for (const LandmarkId id : others[0].map.landmarks.Ids())
    EXPECT_FALSE(main.landmarks.Contains(id));
  EXPECT_THAT(main.CheckInvariants(), IsEmpty());
  EXPECT_THAT(others[0].map.CheckInvariants(), IsEmpty());
  EXPECT_LT(AbsoluteError(main, atlas->main().tracker().trajectory()), 0.01);
  EXPECT_LT(AbsoluteError(others[0].map, others[0].trajectory), 0.01);
}

TEST_F(AtlasTest, TheLargerSubmapLeads) {
  const auto atlas = WalkPastBoth();
  EXPECT_EQ(atlas->main_number(), 1);
  const auto frames = FramesOf(atlas->main().tracker().trajectory());
  EXPECT_FALSE(frames.contains(30));
  EXPECT_TRUE(frames.contains(150));
}

// Where the main submap is given up while another one grows, that one leads: it is neither
// forgotten nor joined with a map to which it has no link.
TEST_F(AtlasTest, AGrowingSubmapLeadsWhereTheMainOneIsGivenUp) {
  Atlas atlas(SlamConfig::Offline(), map_, false, {});
  Walk(atlas, 0, 30, 0, Scene::kLeft);
  ASSERT_LT(atlas.main().Newest()->keyframes.size(), 6U);
  atlas.ForceRelocalization(std::nullopt);
  Walk(atlas, 30, 26, 30, Scene::kRight);
  ASSERT_EQ(atlas.main_number(), 0);
  Walk(atlas, 56, 3, 56, Scene::kAll);  // the camera is found in the main submap, too
  atlas.Process(View(59, 59, Scene::kNothing));
  EXPECT_NE(atlas.main_number(), 0);
  EXPECT_TRUE(FramesOf(atlas.main().tracker().trajectory()).contains(55));
  const std::vector<Submap> others = atlas.Others();
  ASSERT_THAT(others, SizeIs(1));
  EXPECT_TRUE(FramesOf(others[0].trajectory).contains(20));
  for (const KeyframeId id : others[0].map.keyframes.Ids())
    EXPECT_FALSE(atlas.main().snapshot()->keyframes.Contains(id));
}

// A camera that comes back to where a submap waits goes on there, in its frame.
TEST_F(AtlasTest, ASubmapLeadsAgainWhereTheCameraIsBack) {
  Atlas atlas(SlamConfig::Offline(), map_, false, {});
  Walk(atlas, 0, 110, 0, Scene::kLeft);
  const std::vector<KeyframeId> ids = atlas.main().Newest()->keyframes.Ids();
  Walk(atlas, 110, 240, 109, Scene::kRight, -1);
  ASSERT_EQ(atlas.main_number(), 1);
  Walk(atlas, 350, 110, 0, Scene::kLeft);
  EXPECT_EQ(atlas.main_number(), 0);
  // It keeps the numbers that an application may have in its hands.
  const std::shared_ptr<const Map> back = atlas.main().Newest();
  for (const KeyframeId id : ids) EXPECT_TRUE(back->ResolvePose(id)) << id.value;
  const Tracker& tracker = atlas.main().tracker();
  EXPECT_TRUE(tracker.HasTracked(30) && tracker.HasTracked(459));
  EXPECT_LT(AbsoluteError(*atlas.main().Newest(), tracker.trajectory()), 0.02);
  atlas.Finish();
  EXPECT_THAT(atlas.Others(), SizeIs(1));
  EXPECT_THAT(atlas.main().snapshot()->CheckInvariants(), IsEmpty());
}

// A map that is saved before the end has what is being made, too.
TEST_F(AtlasTest, TheSubmapThatIsBeingMadeIsAmongTheOthers) {
  Atlas atlas(SlamConfig::Offline(), map_, false, {});
  Walk(atlas, 0, 110, 0, Scene::kLeft);
  atlas.SetMetresPerUnit(1);  // so that it stays the main one
  Walk(atlas, 110, 40, 109, Scene::kRight, -1);
  const std::vector<Submap> others = atlas.Others();
  ASSERT_THAT(others, SizeIs(1));
  EXPECT_TRUE(FramesOf(others[0].trajectory).contains(149));
  EXPECT_THAT(others[0].map.CheckInvariants(), IsEmpty());
  EXPECT_LT(AbsoluteError(others[0].map, others[0].trajectory), 0.02);
  for (const LandmarkId id : others[0].map.landmarks.Ids())
    EXPECT_FALSE(atlas.main().snapshot()->landmarks.Contains(id));
}

TEST_F(AtlasTest, ThePoseInTheGrowingSubmapIsKnownAtOnce) {
  Atlas atlas(SlamConfig::Offline(), map_, false, {});
  Walk(atlas, 0, 110, 0, Scene::kLeft);
  EXPECT_EQ(atlas.PoseInGrowing(), std::nullopt);
  atlas.SetMetresPerUnit(1);  // so that it stays the main one
  Walk(atlas, 110, 70, 109, Scene::kRight, -1);
  const auto before = atlas.PoseInGrowing();
  ASSERT_TRUE(before);
  Walk(atlas, 180, 1, 39, Scene::kRight, -1);
  const auto now = atlas.PoseInGrowing();
  ASSERT_TRUE(now);
  EXPECT_EQ(atlas.main_number(), 0);
  EXPECT_EQ(now->first, 1);
  EXPECT_EQ(now->second.state, TrackingState::kTracking);
  const Rigid3 motion = *now->second.cam_from_world * before->second.cam_from_world->Inverse(),
               truth = TruePose(39) * TruePose(40).Inverse();
  EXPECT_LT(motion.rotation.angularDistance(truth.rotation), 0.002);
  Walk(atlas, 181, 1, 38, Scene::kNothing, -1);
  EXPECT_EQ(atlas.PoseInGrowing(), std::nullopt);
}

TEST_F(AtlasTest, AMetricSubmapStaysTheMainOne) {
  Atlas atlas(SlamConfig::Offline(), map_, false, {});
  Walk(atlas, 0, 70, 0, Scene::kLeft);
  atlas.SetMetresPerUnit(2);
  Walk(atlas, 70, 90, 69, Scene::kRight, -1);
  EXPECT_EQ(atlas.main_number(), 0);
  atlas.Finish();
  EXPECT_EQ(atlas.main_number(), 0);
  EXPECT_TRUE(atlas.main().snapshot()->is_metric);
  EXPECT_THAT(atlas.Others(), SizeIs(1));
}

TEST_F(AtlasTest, SubmapsAreJoinedOnceFramesShowBoth) {
  const auto atlas = WalkPastBoth();
  Walk(*atlas, 160, 80, -20, Scene::kAll);
  atlas->Finish();
  EXPECT_THAT(atlas->Others(), IsEmpty());
  const Map& map = *atlas->main().snapshot();
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  EXPECT_GT(FramesOf(atlas->main().tracker().trajectory()).size(), 220U);
  EXPECT_LT(AbsoluteError(map, atlas->main().tracker().trajectory()), 0.01);
}

TEST_F(AtlasTest, AJoinedSubmapIsStillAPlaceForPoses) {
  const auto atlas = WalkPastBoth();
  EXPECT_THAT(atlas->Joined(), IsEmpty());
  const Submap before = atlas->Others().at(0);
  Walk(*atlas, 160, 80, -20, Scene::kAll);
  atlas->Finish();
  ASSERT_THAT(atlas->Others(), IsEmpty());
  const std::map<int, Similarity> joined = atlas->Joined();
  ASSERT_THAT(joined, SizeIs(1));
  const auto& [number, main_from_joined] = *joined.begin();
  EXPECT_EQ(number, 0);
  const auto error_in = [&](double factor) {
    const std::shared_ptr<const Map> map = atlas->main().Newest();
    double most = 0;
    int compared = 0;
    for (const FramePose& pose : before.trajectory) {
      const auto now = atlas->main().tracker().PoseOf(pose.frame_index, *map);
      const Eigen::Vector3d was =
          (pose.cam_from_reference * *before.map.ResolvePose(pose.reference)).OriginInSource();
      if (!now) continue;
      ++compared;
      most = std::max(most, (atlas->Joined().at(0) * was - now->OriginInSource()).norm());
    }
    EXPECT_GT(compared, 40);
    return most / factor;
  };
  EXPECT_LT(error_in(main_from_joined.scale), 0.05);
  atlas->SetMetresPerUnit(3);
  EXPECT_NEAR(atlas->Joined().at(0).scale, 3 * main_from_joined.scale, 1e-9);
  EXPECT_LT(error_in(3 * main_from_joined.scale), 0.05);
}

TEST_F(AtlasTest, ASubmapOfAnEarlierRunIsJoinedByALaterOne) {
  const auto first = WalkPastBoth();
  first->Finish();
  Atlas later(SlamConfig::Offline(), *first->main().snapshot(), true, first->Others());
  Walk(later, 160, 80, 20, Scene::kAll);
  later.Finish();
  EXPECT_THAT(later.Others(), IsEmpty());
  EXPECT_TRUE(FramesOf(later.main().tracker().trajectory()).contains(30));
  EXPECT_LT(AbsoluteError(*later.main().snapshot(), later.main().tracker().trajectory()), 0.01);
}

TEST_F(AtlasTest, ASubmapInMetresTellsTheUnitOfTheMainOne) {
  const auto first = WalkPastBoth();
  first->Finish();
  std::vector<Submap> others = first->Others();
  ASSERT_THAT(others, SizeIs(1));
  const double metres = 3;
  others[0].map.Scale(metres);
  others[0].map.is_metric = true;
  for (FramePose& pose : others[0].trajectory) pose.cam_from_reference.translation *= metres;
  Atlas later(SlamConfig::Offline(), *first->main().snapshot(), true, others);
  EXPECT_FALSE(later.TakeMetre());
  Walk(later, 160, 80, 20, Scene::kAll);
  later.Finish();
  ASSERT_THAT(later.Others(), IsEmpty());
  const std::optional<Metre> metre = later.TakeMetre();
  ASSERT_TRUE(metre);
  EXPECT_FALSE(later.TakeMetre());
  // What was a unit of the submap is `metres` by now: a keyframe that both walks saw tells.
  const Map& main = *later.main().snapshot();
  EXPECT_FALSE(main.is_metric);
  double joined_per_unit = 0;
  int steps = 0;
  const std::vector<KeyframeId> ids = others[0].map.keyframes.Ids();
  const auto center = [](const Map& map, KeyframeId id) {
    return map.keyframes.At(id).cam_from_world.OriginInSource();
  };
  std::map<int, KeyframeId> in_main;
  main.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) { in_main[k.frame_index] = id; });
  for (size_t i = 1; i < ids.size(); ++i) {
    const auto a = in_main.find(others[0].map.keyframes.At(ids[0]).frame_index),
               b = in_main.find(others[0].map.keyframes.At(ids[i]).frame_index);
    if (a == in_main.end() || b == in_main.end()) continue;
    joined_per_unit += (center(others[0].map, ids[0]) - center(others[0].map, ids[i])).norm() /
                       (center(main, a->second) - center(main, b->second)).norm();
    ++steps;
  }
  ASSERT_GT(steps, 0);
  EXPECT_NEAR(metre->metres_per_unit / (joined_per_unit / steps), 1, 0.1);
}

TEST_F(AtlasTest, RunsRepeatExactly) {
  std::vector<Eigen::Vector3d> centers[2];
  for (auto& run : centers) {
    rng_ = Rng(7);
    const auto atlas = WalkPastBoth();
    for (int i = 0; i < 60; i += 10) {
      Walk(*atlas, 160 + i, 10, -20 + i, Scene::kAll);
      if (&run == centers) continue;
      // Who saves the map on the way does not change what follows.
      atlas->main().Mapped();
      atlas->Others();
    }
    atlas->Finish();
    for (const FramePose& pose : atlas->main().tracker().trajectory())
      run.push_back(
          (pose.cam_from_reference * *atlas->main().snapshot()->ResolvePose(pose.reference))
              .OriginInSource());
  }
  EXPECT_GT(centers[0].size(), 180U);
  EXPECT_EQ(centers[0], centers[1]);
}

TEST_F(AtlasTest, WithoutMappingTheMapStaysAsItIs) {
  const auto first = WalkPastBoth();
  first->Finish();
  Atlas reader(SlamConfig::Offline(), *first->main().snapshot(), true, {});
  reader.SetMapping(false);
  Walk(reader, 160, 30, 20, Scene::kNothing);
  reader.Finish();
  EXPECT_THAT(reader.Others(), IsEmpty());
  EXPECT_EQ(reader.main().snapshot()->keyframes.size(), first->main().snapshot()->keyframes.size());
}

TEST_F(AtlasTest, WhatWasSeenWithMappingIsKeptWithout) {
  const auto first = WalkPastBoth();
  Atlas reader(SlamConfig::Offline(), *first->main().snapshot(), true, {});
  reader.SetMapping(false);
  Walk(reader, 160, 30, 20, Scene::kLeft);
  reader.SetMapping(true);
  Walk(reader, 190, 30, 50, Scene::kLeft);
  reader.SetMapping(false);
  Walk(reader, 220, 10, 80, Scene::kLeft);
  reader.Finish();
  EXPECT_THAT(reader.Others(), SizeIs(1));
  EXPECT_THAT(reader.main().snapshot()->CheckInvariants(), IsEmpty());
}

}  // namespace
}  // namespace oaslam
