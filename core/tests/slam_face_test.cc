// What the public interface gives to an application besides poses: the map as data, the newest
// state for other threads, single images found by many threads, metres.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <future>
#include <map>
#include <set>
#include <thread>
#include <type_traits>

#include "desk_clip.h"
#include "expect_input_error.h"
#include "forked.h"
#include "oaslam/oaslam.h"

namespace oaslam {
namespace {

// Only Live and Offline make a configuration, so that nobody takes one for the other.
static_assert(!std::is_default_constructible_v<SlamConfig> && !std::is_aggregate_v<SlamConfig>);

// Pixels between where a point is seen and where it is expected.
double Error(const Camera& camera, const Rigid3& world_from_cam, const Eigen::Vector3d& position,
             const Eigen::Vector2d& pixel) {
  return (camera.Project(world_from_cam.Inverse() * position).value() - pixel).norm();
}

double Median(std::vector<double> values) {
  std::ranges::sort(values);
  return values.at(values.size() / 2);
}

TEST_F(SlamWithMap, GivesTheMapAndWhatIsTrackedAsData) {
  Slam slam = MakeSlam();
  EXPECT_THAT(slam.TrackedPoints(), IsEmpty());
  EXPECT_EQ(MapSnapshot().Keyframes().size() + slam.Snapshot().Landmarks().size(), 0U);
  slam.Load(Path());
  TrackingResult tracked;
  for (size_t i = 30; i < 33; ++i) tracked = slam.Process(WithDetections(i));
  ASSERT_EQ(tracked.state, TrackingState::kTracking);

  const std::vector<TrackedPoint> points = slam.TrackedPoints();
  EXPECT_THAT(points, SizeIs(static_cast<size_t>(tracked.keypoints)));
  std::vector<double> errors;
  for (const TrackedPoint& point : points)
    if (point.landmark)
      errors.push_back(
          Error(clip().camera, *tracked.PoseIn(tracked.world), point.position, point.pixel) /
          point.sigma_px);
  EXPECT_EQ(static_cast<int>(errors.size()), tracked.inliers);
  EXPECT_LT(Median(errors), 2);

  const MapSnapshot map = slam.Snapshot();
  EXPECT_EQ(map.Cameras().front(), clip().camera);
  const auto keyframes = map.Keyframes().ToVector();
  ASSERT_EQ(keyframes.size(), map.Keyframes().size());
  EXPECT_EQ(keyframes.front().frame, std::nullopt);  // of the file
  EXPECT_EQ(map.Landmarks().ToVector().size(), map.Landmarks().size());
  const auto descriptors = map.Descriptors(keyframes.back().id);
  errors.clear();
  for (const MapSnapshot::Observation& o : map.Observations(keyframes.back().id)) {
    const auto landmark = map.Find(o.landmark);
    ASSERT_TRUE(landmark);
    EXPECT_LT(static_cast<size_t>(o.keypoint), descriptors.size());
    errors.push_back(
        Error(clip().camera, keyframes.back().world_from_cam, landmark->position, o.pixel) /
        o.sigma_px);
    const auto seen_in = map.Observations(o.landmark);
    EXPECT_THAT(seen_in, SizeIs(static_cast<size_t>(landmark->observations)));
    EXPECT_EQ(std::ranges::count(seen_in, o.keyframe, &MapSnapshot::Observation::keyframe), 1);
  }
  EXPECT_LT(Median(errors), 2);
  EXPECT_THAT(map.Observations(KeyframeId(1 << 30)), IsEmpty());
  EXPECT_THAT(map.Observations(LandmarkId(1 << 30)), IsEmpty());
  EXPECT_THAT(map.Descriptors({}), IsEmpty());
  EXPECT_FALSE(map.Find(KeyframeId(1 << 30)) || map.Find(LandmarkId()) || map.Find(ObjectId(77)));
  ASSERT_FALSE(map.Objects().empty());
  for (const MapSnapshot::Object& object : map.Objects()) {
    EXPECT_EQ(object.name, fmt::format("class {}", object.category_id));  // its names are others
    EXPECT_GT(object.covariance.diagonal().minCoeff(), 0);
    EXPECT_EQ(map.Find(object.id)->ellipsoid.center, object.ellipsoid.center);
  }
  EXPECT_FALSE(map.is_metric());
  // A snapshot is of its moment.
  slam.Reset();
  EXPECT_EQ(map.Keyframes().size(), keyframes.size());
}

TEST_F(SlamWithMap, GoesOnInMetres) {
  constexpr double kMetres = 2.5;
  Slam plain = MakeSlam(), metric = MakeSlam();
  for (size_t i = 0; i < 70; ++i)
    for (Slam* slam : {&plain, &metric}) slam->Process(WithDetections(i));
  const auto before = metric.Trajectory();
  for (const double wrong : {0.0, -1.0, std::nan(""), double{INFINITY}})
    EXPECT_INPUT_ERROR(metric.SetMetresPerUnit(wrong), HasSubstr("above 0"));
  const WorldId plain_world = metric.Snapshot().world();
  metric.SetMetresPerUnit(kMetres);
  EXPECT_TRUE(metric.Snapshot().is_metric());
  ASSERT_THAT(metric.FormerWorlds(), testing::SizeIs(1));
  EXPECT_EQ(metric.FormerWorlds()[0].world, plain_world);
  EXPECT_EQ(metric.FormerWorlds()[0].scale, kMetres);
  EXPECT_EQ(metric.States().EventsAfter(0).back().kind, SlamEventKind::kMetric);
  const auto after = metric.Trajectory();
  ASSERT_EQ(after.size(), before.size());
  const double length =
      (before.back().world_from_cam.translation - before.front().world_from_cam.translation).norm();
  EXPECT_NEAR(
      (after.back().world_from_cam.translation - after.front().world_from_cam.translation).norm(),
      kMetres * length, 0.02 * kMetres * length);
  for (size_t i = 70; i < 110; ++i) {
    const TrackingResult expected = plain.Process(WithDetections(i)),
                         result = metric.Process(WithDetections(i));
    ASSERT_EQ(result.state, TrackingState::kTracking) << i;
    EXPECT_LT((result.PoseIn(result.world)->translation -
               kMetres * expected.PoseIn(expected.world)->translation)
                  .norm(),
              0.03 * kMetres * expected.depth)
        << i;
  }
  metric.Finish();
  EXPECT_NEAR(metric.Snapshot().Objects().begin()->ellipsoid.half_axes.norm(),
              kMetres * plain.Snapshot().Objects().begin()->ellipsoid.half_axes.norm(),
              0.3 * kMetres);
  metric.Save(Path("metric.map"));
  Slam again = MakeSlam();
  again.Load(Path("metric.map"));
  EXPECT_TRUE(again.Snapshot().is_metric());
}

TEST_F(SlamWithMap, ImagesAreFoundByManyThreadsAndNearAPriorPose) {
  Slam slam = MakeSlam();
  slam.Load(Path());
  const RelocalizationResult expected = slam.Relocalize(WithDetections(30));
  ASSERT_TRUE(expected.world_from_cam);
  EXPECT_EQ(expected.candidates_are_by, PoseEvidence::kObjects);
  const MapLocalizer localizer(Path());
  EXPECT_EQ(localizer.map().Landmarks().size(), slam.Snapshot().Landmarks().size());
  std::vector<std::future<RelocalizationResult>> answers;
  for (int i = 0; i < 4; ++i)
    answers.push_back(std::async(std::launch::async, [localizer] {
      return localizer.Relocalize(WithDetections(30), {.camera = clip().camera});
    }));
  for (auto& answer : answers)
    EXPECT_EQ(answer.get().world_from_cam->translation, expected.world_from_cam->translation);
  EXPECT_INPUT_ERROR(MapLocalizer(Path("nothing.map")), HasSubstr("nothing.map"));

  // About a prior pose one place is looked at; a wrong one costs nothing but time.
  Rigid3 prior = *expected.world_from_cam;
  prior.translation += Eigen::Vector3d(0.02, 0, 0);
  const RelocalizationResult near = slam.Relocalize(WithoutDetections(30), {.prior = prior});
  ASSERT_TRUE(near.world_from_cam);
  EXPECT_THAT(near.candidates, SizeIs(1));
  EXPECT_LT((near.world_from_cam->translation - expected.world_from_cam->translation).norm(), 0.02);
  prior.translation += Eigen::Vector3d(50, 0, 0);
  EXPECT_EQ(slam.Relocalize(WithDetections(30), {.prior = prior}).world_from_cam->translation,
            expected.world_from_cam->translation);
  prior.translation.x() = std::nan("");
  EXPECT_INPUT_ERROR(slam.Relocalize(WithDetections(30), {.prior = prior}), HasSubstr("pose"));
  slam.ForceRelocalization(expected.world_from_cam);
  EXPECT_EQ(slam.Process(WithoutDetections(31)).state, TrackingState::kRelocalized);
}

TEST_F(SlamWithMap, OtherThreadsGetTheNewestState) {
  std::vector<int> frames;
  SlamStates states = MakeSlam().States();
  EXPECT_TRUE(states.HasEnded());
  EXPECT_EQ(states.WaitForNext(states.Newest(), std::chrono::milliseconds::max()), nullptr);
  std::jthread reader;
  {
    Slam slam = MakeSlam();
    states = slam.States();
    EXPECT_FALSE(states.HasEnded());
    const auto first = states.Newest();
    EXPECT_EQ(first->result.frame, -1);
    EXPECT_EQ(first->map.Keyframes().size(), 0U);
    EXPECT_EQ(states.WaitForNext(first, std::chrono::milliseconds(1)), nullptr);
    reader = std::jthread([states, &frames] {
      auto last = states.Newest();
      while ((last = states.WaitForNext(last, std::chrono::milliseconds::max())))
        frames.push_back(last->result.frame);
    });
    for (size_t i = 0; i < 20; ++i) slam.Process(WithDetections(i));
    ASSERT_TRUE(states.Newest());
    EXPECT_EQ(states.Newest()->result.frame, 19);
    // Also in another map.
    slam.Load(Path());
    EXPECT_EQ(states.Newest()->result.frame, -1);
    EXPECT_EQ(states.Newest()->map.Keyframes().size(), slam.Snapshot().Keyframes().size());
    slam.Process(WithDetections(30));
    EXPECT_EQ(states.Newest()->result.state, TrackingState::kRelocalized);
    EXPECT_EQ(states.Newest()->map.Keyframes().size(), slam.Snapshot().Keyframes().size());
    slam.Reset();
    EXPECT_EQ(states.Newest()->map.Keyframes().size(), 0U);
    slam.Process(WithDetections(31));
    EXPECT_EQ(states.Newest()->map.Keyframes().size(), 0U);
  }
  reader.join();
  EXPECT_FALSE(frames.empty());
  EXPECT_TRUE(states.Newest());
}

// Every call that changes the map shows it, with the newest image's pose in it, and versions
// ascend.
TEST_F(SlamWithMap, StatesShowWhatNoImageHasChanged) {
  Slam slam = MakeSlam();
  const SlamStates states = slam.States();
  uint64_t version = 0;
  const auto expect_news = [&](const char* call) {
    EXPECT_GT(states.Newest()->map.version(), version) << call;
    version = states.Newest()->map.version();
    EXPECT_EQ(slam.Snapshot().version(), version) << call;
  };
  expect_news("start");
  for (size_t i = 0; i < 70; ++i) slam.Process(WithDetections(i));
  expect_news("Process");
  const auto keyframes = slam.Snapshot().Keyframes().ToVector();
  EXPECT_EQ(keyframes.back().timestamp,
            WithDetections(static_cast<size_t>(keyframes.back().frame.value())).timestamp);
  const auto before = states.Newest();
  slam.SetMetresPerUnit(3);
  expect_news("SetMetresPerUnit");
  EXPECT_TRUE(states.Newest()->map.is_metric());
  EXPECT_EQ(states.Newest()->result.frame, 69);
  const auto pose_of = [](const SlamState& state) {
    return state.result.PoseIn(state.map.world()).value();
  };
  EXPECT_LT((pose_of(*states.Newest()).translation - 3 * pose_of(*before).translation).norm(),
            0.03 * 3 * before->result.depth);
  EXPECT_EQ(states.Newest()->result.depth, 3 * before->result.depth);
  EXPECT_TRUE(slam.PlaceAnchor({.name = "flag", .model = "flag", .pose = Rigid3()}).IsDone());
  expect_news("PlaceAnchor");
  EXPECT_THAT(states.Newest()->map.Anchors(), SizeIs(1));
  EXPECT_TRUE(slam.EditAnchor("flag", {.size = 2}).IsDone());
  expect_news("EditAnchor");
  EXPECT_TRUE(slam.RemoveAnchor("flag").IsDone());
  expect_news("RemoveAnchor");
  slam.SetClassNames({{1, "mine"}});
  expect_news("SetClassNames");
  slam.SetMapping(false);
  expect_news("SetMapping");
  slam.SetMapping(true);
  slam.ForceRelocalization();
  EXPECT_EQ(slam.Snapshot().version(), states.Newest()->map.version());
  version = states.Newest()->map.version();
  slam.Finish();
  expect_news("Finish");
  EXPECT_EQ(pose_of(*states.Newest()).translation,
            slam.Trajectory().back().world_from_cam.translation);
  slam.Load(Path());
  expect_news("Load");
  slam.Reset();
  expect_news("Reset");
}

TEST_F(SlamWithMap, StatesShowDetectionsThatCameLater) {
  Slam slam = MakeSlam();
  const SlamStates states = slam.States();
  slam.Load(Path());
  for (size_t i = 30; i < 34; ++i) {
    ImageInput input = WithoutDetections(i);
    input.detections_follow = true;
    const TrackingResult result = slam.Process(input);
    ASSERT_TRUE(result.HasPose());
    EXPECT_EQ(states.Newest()->result.detections, 0);
    const auto boxes = WithDetections(i).detections;
    const std::optional<int> objects = slam.AddDetections(result.frame, boxes);
    ASSERT_GT(objects.value_or(0), 0);
    EXPECT_EQ(states.Newest()->result.frame, result.frame);
    EXPECT_EQ(states.Newest()->result.objects, *objects);
    EXPECT_EQ(states.Newest()->result.detections, static_cast<int>(boxes.size()));
    EXPECT_EQ(states.Newest()->result.state, result.state);
  }
}

TEST_F(SlamWithMap, MetresNeedAMapAndKeepIt) {
  Slam slam = MakeSlam();
  EXPECT_INPUT_ERROR(slam.SetMetresPerUnit(2), HasSubstr("no map yet"));
  size_t i = 0;
  while (slam.Process(WithDetections(i)).state != TrackingState::kTracking) ++i;
  slam.SetMetresPerUnit(2);
  // Such a small map would be given up otherwise.
  const TrackingResult lost = slam.Process(
      {.image = cv::Mat::zeros(480, 640, CV_8UC1), .timestamp = WithDetections(i + 1).timestamp});
  EXPECT_FALSE(lost.HasPose());
  EXPECT_TRUE(slam.Snapshot().is_metric());
  EXPECT_GE(slam.Snapshot().Keyframes().size(), 2U);
}

TEST_F(SlamWithMap, BoxesOfAnImageThatIsTrackedMayBeFollowedToo) {
  Slam slam = MakeSlam();
  slam.Load(Path());
  for (size_t i = 30; i < 32; ++i) {
    const ImageInput input = WithDetections(i);
    slam.Relocalize({.image = {}, .timestamp = input.timestamp, .detections = input.detections},
                    {.follow = true});
    EXPECT_EQ(slam.Process(input).frame, static_cast<int>(i) - 30);
  }
}

// An application with content in coordinates of its own, which knows nothing of submaps: it
// asks for the pose in the world in which it made the content.
TEST_F(SlamWithMap, ANaiveApplicationDrawsNothingWrong) {
  Slam slam = MakeSlam();
  for (size_t i = 0; i < 40; ++i) slam.Process(WithoutDetections(i));
  const MapSnapshot map = slam.Snapshot();
  const Eigen::Vector3d content = map.Landmarks().begin()->position;
  const WorldId world = map.world();
  const auto draw = [&](const TrackingResult& result) -> std::optional<Eigen::Vector2d> {
    const auto pose = result.PoseIn(world);
    return pose ? clip().camera.Project(pose->Inverse() * content) : std::nullopt;
  };
  EXPECT_TRUE(draw(slam.Process(WithoutDetections(40))));
  // Elsewhere, where another map is made, which becomes the larger one.
  int tracked = 0;
  for (size_t i = 41; i < 150; ++i) {
    const TrackingResult result = slam.Process(Mirrored(i));
    EXPECT_FALSE(draw(result)) << i;
    EXPECT_EQ(result.world, slam.Snapshot().world());
    tracked += result.HasPose();
  }
  EXPECT_GT(tracked, 10);
  EXPECT_NE(slam.Snapshot().world(), world);
  EXPECT_EQ(slam.States().Newest()->result.world, slam.Snapshot().world());
  // It could have known.
  std::vector<SlamEvent> events = slam.States().EventsAfter(0);
  std::erase_if(events, [](const SlamEvent& e) { return e.kind == SlamEventKind::kState; });
  ASSERT_THAT(events, SizeIs(1));
  EXPECT_EQ(events[0].kind, SlamEventKind::kWorld);
  EXPECT_EQ(events[0].world, slam.Snapshot().world());
  EXPECT_EQ(events[0].timestamp, Mirrored(static_cast<size_t>(events[0].frame)).timestamp);
}

TEST_F(SlamWithMap, WhatChangesTheFrameOrTheUnitBeginsAWorld) {
  Slam slam = MakeSlam();
  std::set<WorldId> worlds{slam.Snapshot().world()};
  const auto is_new = [&] { return worlds.insert(slam.Snapshot().world()).second; };
  for (size_t i = 0; i < 40; ++i) slam.Process(WithoutDetections(i));
  EXPECT_FALSE(is_new());
  slam.SetMetresPerUnit(2);
  EXPECT_TRUE(is_new());
  EXPECT_EQ(slam.States().Newest()->result.world, slam.Snapshot().world());
  slam.Reset();
  EXPECT_TRUE(is_new());
  slam.Load(Path());
  EXPECT_TRUE(is_new());
  slam.Load(Path());
  EXPECT_TRUE(is_new());
  // What is in memory already stays what it is.
  const MapLocalizer localizer(Path());
  slam.Load(localizer.map());
  EXPECT_TRUE(is_new());
  EXPECT_EQ(localizer.Relocalize(WithDetections(30), {.camera = clip().camera}).world,
            slam.Relocalize(WithDetections(30)).world);
  EXPECT_EQ(slam.Process(WithDetections(30)).world, localizer.map().world());
}

// Numbers of landmarks are of those that were looked for in the image.
TEST_F(SlamWithMap, AnImageCarriedByTheMotionHasNoInliers) {
  Slam slam = MakeSlam();
  std::map<PoseSource, int> sources;
  for (size_t i = 0; i < 140; ++i) {
    const TrackingResult result = slam.Process(WithoutDetections(i));
    if (result.state != TrackingState::kTracking) continue;
    ++sources[result.source];
    EXPECT_EQ(result.source == PoseSource::kMap, result.inliers.has_value());
    EXPECT_EQ(result.keypoints > 0, result.inliers.has_value());
    EXPECT_GT(result.inliers.value_or(1), 0);
  }
  EXPECT_GT(sources[PoseSource::kMap], 40);
  EXPECT_GT(sources[PoseSource::kMotion], 10);
}

TEST_F(SlamWithMap, TheMapAsDataIsThatOfTheFile) {
  const MapSnapshot map = MapSnapshot::Load(Path());
  Slam slam = MakeSlam();
  slam.Load(Path());
  ExpectSameMap(map, slam.Snapshot());
  EXPECT_GT(map.Trajectory().size(), map.Keyframes().size());
  map.Save(Path("copy.map"));
  ExpectSameMap(map, MapSnapshot::Load(Path("copy.map")));
  EXPECT_EQ(map.Trajectory().size(), MapSnapshot::Load(Path("copy.map")).Trajectory().size());
  EXPECT_NE(map.world(), MapSnapshot::Load(Path()).world());
  EXPECT_EQ(map.CategoryNames().at(1), "mine");
}

// The cells of the table in slam.h that slam_test.cc does not look at: orders of calls.
TEST_F(SlamWithMap, ResetLoadAndSetMappingInAnyOrder) {
  Slam slam = MakeSlam();
  slam.SetMapping(false);
  slam.Reset();
  slam.Load(Path());
  const MapSnapshot loaded = slam.Snapshot();
  for (size_t i = 20; i < 60; ++i) slam.Process(WithDetections(i));
  ExpectSameMap(slam.Snapshot(), loaded);  // mapping is off, by the first call
  // SetMapping keeps the map, the trajectory, and the camera's pose; frame numbers and times go on.
  ASSERT_FALSE(slam.PlaceAnchor({.name = "flag", .model = "flag", .pose = Rigid3()}).name.empty());
  const size_t poses = slam.Trajectory().size();
  slam.SetMapping(true);
  ExpectSameMap(slam.Snapshot(), loaded);
  EXPECT_THAT(slam.Anchors(), SizeIs(1));
  EXPECT_EQ(slam.Trajectory().size(), poses);
  EXPECT_INPUT_ERROR(slam.Process(WithDetections(59)), HasSubstr("time stamp"));
  const TrackingResult next = slam.Process(WithDetections(60));
  EXPECT_EQ(next.frame, 40);
  EXPECT_EQ(next.state, TrackingState::kTracking);
  // Load after mapping: the file again, without the anchor, and still with mapping.
  slam.Load(Path());
  ExpectSameMap(slam.Snapshot(), loaded);
  EXPECT_THAT(slam.Anchors(), IsEmpty());
  for (size_t i = 60; i < 120; ++i) slam.Process(WithDetections(i));
  slam.Finish();
  EXPECT_NE(PlacesOf(slam.Snapshot()), PlacesOf(loaded));
  // Reset after Load: an empty map, which the next images make.
  slam.Reset();
  EXPECT_EQ(slam.Process(WithDetections(0)).state, TrackingState::kPreliminary);
  EXPECT_EQ(slam.Snapshot().Objects().size(), 0U);
}

TEST_F(SlamWithMap, ObjectsAreEditedInTheMapThatIsMade) {
  Slam slam = MakeSlam();
  slam.Load(Path());
  const auto objects = slam.Snapshot().Objects().ToVector();
  ASSERT_GE(objects.size(), 2U);
  const ObjectId first = objects[0].id, second = objects[1].id;
  slam.EditObject(first, {.name = "mine"});
  EXPECT_EQ(slam.Snapshot().Find(first)->name, "mine");
  ASSERT_TRUE(slam.PlaceAnchor({.model = "flag", .object = first}).IsDone());
  slam.EditObject(first, {.remove = true});
  EXPECT_FALSE(slam.Snapshot().Find(first));
  EXPECT_EQ(slam.States().EventsAfter(0).back().kind, SlamEventKind::kAnchorLost);
  EXPECT_INPUT_ERROR(slam.EditObject(first, {.name = "gone"}), HasSubstr("no object"));
  EXPECT_INPUT_ERROR(slam.EditObject(second, {.same_as = second}), HasSubstr("one object"));
  // Nothing of it is in the map as data, and the file has what was edited.
  const MapSnapshot map = MapSnapshot::Load(Path());
  const MapSnapshot edited = EditObject(map, second, {.name = "ours"});
  EXPECT_NE(map.Find(second)->name, "ours");
  EXPECT_EQ(MapSnapshot::FromBytes(edited.ToBytes()).Find(second)->name, "ours");
  EXPECT_EQ(edited.world(), map.world());
}

TEST_F(SlamWithMap, MapsAreMergedAndExportedAsData) {
  const MapSnapshot map = MapSnapshot::Load(Path());
  const MergedMaps both = MergeMaps(map, map, RelocalizationMode::kPoints);
  ASSERT_TRUE(both.map) << both.evidence;
  EXPECT_GT(both.map->Keyframes().size(), map.Keyframes().size());
  EXPECT_THAT(both.evidence, HasSubstr("keyframes of the second map are found"));
  EXPECT_FALSE(MergeMaps(map, MapSnapshot()).map);

  const auto exported = [&](MapFormat format, const std::string& name) {
    ExportMap(map, format, Path(name));
    return std::filesystem::exists(Path(name));
  };
  EXPECT_TRUE(exported(MapFormat::kPly, "a.ply"));
  EXPECT_TRUE(exported(MapFormat::kGltf, "a.glb"));
  EXPECT_TRUE(exported(MapFormat::kTum, "a.txt"));
  EXPECT_TRUE(exported(MapFormat::kColmap, "colmap"));
  EXPECT_TRUE(std::filesystem::exists(Path("colmap/points3D.txt")));
  EXPECT_TRUE(exported(MapFormat::kNerfstudio, "nerf"));
  EXPECT_TRUE(exported(MapFormat::kMcap, "a.mcap"));
  EXPECT_INPUT_ERROR(exported(MapFormat::kPly, "a.glb"), HasSubstr("a file .ply"));
  EXPECT_INPUT_ERROR(exported(static_cast<MapFormat>(77), "odd"), HasSubstr("format 77"));
  EXPECT_FALSE(std::filesystem::exists(Path("odd")));
  EXPECT_INPUT_ERROR(ExportMap(MapSnapshot(), MapFormat::kPly, Path("b.ply")), HasSubstr("empty"));
  EXPECT_INPUT_ERROR(ExportMap(map, MapFormat::kColmap, Path("c"), {.images = {"one", "another"}}),
                     HasSubstr("2 sources of images for a map of 1 recordings"));
}

TEST_F(SlamWithMap, EventsTellWhatHappenedBetweenTwoLooks) {
  Slam slam = MakeSlam();
  const SlamStates states = slam.States();
  EXPECT_TRUE(states.EventsAfter(0).empty());
  slam.Load(Path());
  for (size_t i = 40; i < 60; ++i) slam.Process(WithDetections(i));
  std::vector<SlamEvent> events = states.EventsAfter(0);
  ASSERT_GE(events.size(), 3U);
  EXPECT_EQ(events[0].kind, SlamEventKind::kWorld);
  EXPECT_EQ(events[0].world, slam.Snapshot().world());
  EXPECT_EQ(events[1].kind, SlamEventKind::kState);
  EXPECT_EQ(events[1].state, TrackingState::kLost);
  EXPECT_EQ(events.back().state, TrackingState::kTracking);
  for (size_t i = 0; i < events.size(); ++i) EXPECT_EQ(events[i].number, i + 1);

  const uint64_t seen = events.back().number;
  ASSERT_TRUE(slam.PlaceAnchor({.name = "a", .model = "flag", .pose = Rigid3()}).IsDone());
  ASSERT_TRUE(slam.EditAnchor("a", {.size = 2}).IsDone());
  ASSERT_TRUE(slam.EditAnchor("a", {}).IsDone());  // changes nothing
  ASSERT_TRUE(slam.EditAnchor("a", {.name = "b"}).IsDone());
  ASSERT_FALSE(slam.RemoveAnchor("a").IsDone());
  ASSERT_TRUE(slam.RemoveAnchor("b").IsDone());
  events = states.EventsAfter(seen);
  using enum SlamEventKind;
  const std::vector<std::pair<SlamEventKind, std::string>> expected = {
      {kAnchorPlaced, "a"}, {kAnchorEdited, "a"},  {kAnchorRemoved, "a"},
      {kAnchorPlaced, "b"}, {kAnchorRemoved, "b"},
  };
  ASSERT_EQ(events.size(), expected.size());
  for (size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(std::pair(events[i].kind, events[i].anchor), expected[i]) << i;
    EXPECT_EQ(events[i].frame, 19);
  }
  EXPECT_EQ(states.EventsAfter(events.back().number).size(), 0U);
}

// A forked child has the objects of its parent, but no threads of theirs.
TEST(Slam, IsRefusedToAForkedChildWhichEndsAndMakesItsOwn) {
  const Clip clip(0, 40);
  for (const SlamConfig& config : {SlamConfig::Live(), SlamConfig::Offline()}) {
    auto slam = std::make_unique<Slam>(config, clip.camera);
    const SlamStates states = slam->States();
    auto film = OpenImages(clip.kFolder + "/video.mp4");
    LatestImageSource latest(OpenImages(clip.kFolder + "/video.mp4"));
    for (const ImageInput& image : clip.images) slam->Process(image);
    ASSERT_TRUE(film->Next());
    slam->WholeMap();  // waits until it is mapped: its thread may hold locks of OpenCV
    EXPECT_TRUE(HoldsInChild([&] {
      EXPECT_THROW(slam->Process(clip.images[0]), ForkError);
      EXPECT_THROW(slam->Finish(), ForkError);
      EXPECT_THROW(states.Newest(), ForkError);
      EXPECT_THROW(states.WaitForNext(nullptr, std::chrono::milliseconds(1)), ForkError);
      EXPECT_THROW(film->Next(), ForkError);
      EXPECT_THROW(latest.Next(), ForkError);
      latest.Stop();
      EXPECT_THROW(LatestImageSource(std::move(film)).Next(), ForkError);
      slam = std::make_unique<Slam>(config, clip.camera);
      for (const ImageInput& image : clip.images) slam->Process(image);
      slam->Finish();
      EXPECT_EQ(slam->Trajectory().size(), clip.images.size());
      return !testing::Test::HasFailure();
    }));
    slam->Finish();
    EXPECT_EQ(slam->Trajectory().size(), clip.images.size());
    EXPECT_EQ(film->Next()->index, 1);
  }
}

}  // namespace
}  // namespace oaslam
