// The public interface on the desk sample, used as by an application.

#include "oaslam/slam.h"

#include <algorithm>

#include "desk_clip.h"
#include "expect_input_error.h"
#include "oaslam/camera_estimation.h"
#include "oaslam/map_localizer.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/storage/map_file.h"

namespace oaslam {
namespace {

constexpr int kLag = 6;  // number of images by which the detector is late

// Processes a clip with a late detector; returns the total number of mapped objects seen.
int Follow(const Clip& clip, Slam& slam) {
  int seen = 0;
  std::vector<int> frames;
  for (size_t i = 0; i < clip.images.size(); ++i) {
    frames.push_back(slam.Process(clip.images[i]).frame);
    if (i >= kLag)
      seen += slam.AddDetections(frames[i - kLag], clip.detections[i - kLag]).value_or(0);
  }
  return seen;
}

TEST(Slam, AMapIsUsedAgainWithALateDetectorAndItsAnchors) {
  const Clip clip(0, 150);
  const TempFolder folder;
  Slam first(SlamConfig::Offline(), clip.camera);
  ASSERT_GT(Follow(clip, first), 0);
  first.Finish();
  const MapSnapshot map = first.Snapshot();
  ASSERT_FALSE(map.Objects().empty());
  const MapSnapshot::Object object = *map.Objects().begin();

  AnchorRequest request{.model = "flag", .object = object.id};
  request.origin = map.Keyframes().ToVector().back().world_from_cam.translation;
  request.direction = object.ellipsoid.center - request.origin;
  ASSERT_EQ(first.PlaceAnchor(request).name, "flag 1");
  request.object = ObjectId(99999);
  EXPECT_THAT(first.PlaceAnchor(request).why_not, HasSubstr("no object 99999"));
  EXPECT_EQ(first.EditAnchor("flag 1", {.name = "sign", .turn_rad = 0.1}).name, "sign");
  EXPECT_THAT(first.EditAnchor("flag 1", {}).why_not, HasSubstr("no anchor"));
  ASSERT_THAT(first.Anchors(), SizeIs(1));
  const AnchorPose placed = first.Anchors().front();
  EXPECT_LT((placed.world_from_anchor.translation - object.ellipsoid.center).norm(),
            1.01 * object.ellipsoid.half_axes.maxCoeff());
  const auto last_pose = first.States().Newest()->result.PoseIn(map.world());
  ASSERT_TRUE(last_pose && placed.cam_from_anchor);
  EXPECT_LT(
      (*last_pose * placed.cam_from_anchor->translation - placed.world_from_anchor.translation)
          .norm(),
      1e-9);
  first.Save(folder / "desk.map");

  Slam second(SlamConfig::Offline(), clip.camera);
  second.Load(folder / "desk.map");
  ASSERT_THAT(second.Anchors(), SizeIs(1));
  EXPECT_EQ(second.Anchors().front().name, "sign");
  EXPECT_LT((second.Anchors().front().world_from_anchor.translation -
             placed.world_from_anchor.translation)
                .norm(),
            1e-12);
  EXPECT_GT(Follow(Clip(200, 260), second), 60);  // each image shows several
  // The anchor moves with the object, whose ellipsoid is refined meanwhile.
  const auto now = second.Snapshot().Find(object.id);
  ASSERT_TRUE(now);
  EXPECT_LT((second.Anchors().front().world_from_anchor.translation - now->ellipsoid.center).norm(),
            1.2 * object.ellipsoid.half_axes.maxCoeff());
  // Where the newest image shows a place, the anchor is seen.
  const Eigen::Vector2d pixel(320, 240);
  ASSERT_EQ(second.PlaceAnchor({.name = "middle", .model = "flag", .pixel = pixel}).why_not, "");
  const AnchorPose middle = second.Anchors().front();
  ASSERT_TRUE(middle.name == "middle" && middle.cam_from_anchor);
  const auto seen_at = clip.camera.Project(middle.cam_from_anchor->translation);
  ASSERT_TRUE(seen_at);
  EXPECT_LT((*seen_at - pixel).norm(), 2);
  EXPECT_THAT(second.PlaceAnchor({.model = "flag", .pixel = Eigen::Vector2d(320, 2000)}).why_not,
              HasSubstr("not in the image"));
  EXPECT_TRUE(second.RemoveAnchor("middle").IsDone());
  EXPECT_TRUE(second.RemoveAnchor("sign").IsDone());
  EXPECT_FALSE(second.RemoveAnchor("sign").IsDone());
  EXPECT_THAT(second.Anchors(), IsEmpty());
}

TEST_F(SlamWithMap, ResetForgetsTheMapAndKeepsTheSettings) {
  Slam slam = MakeSlam();
  slam.SetClassNames({{1, "mine"}});
  slam.SetClassRelations(kRelations);
  slam.SetRelocalizationMode(RelocalizationMode::kObjects);
  for (size_t i = 0; i < 40; ++i) slam.Process(WithDetections(i));
  ASSERT_GT(slam.Snapshot().Keyframes().size(), 0U);
  slam.Reset();
  EXPECT_EQ(slam.Snapshot().Keyframes().size(), 0U);
  EXPECT_THAT(slam.Trajectory(), IsEmpty());
  EXPECT_EQ(slam.Snapshot().CategoryNames(), (ClassNames{{1, "mine"}}));
  EXPECT_EQ(MapOf(slam.Snapshot())->classes, kRelations);
  // Time stamps and frame numbers begin anew, and the map is that of a new Slam.
  Slam fresh = MakeSlam();
  fresh.SetClassRelations(kRelations);
  for (size_t i = 0; i < 40; ++i) {
    const TrackingResult result = slam.Process(WithDetections(i));
    EXPECT_EQ(result.frame, static_cast<int>(i));
    EXPECT_EQ(result.world, slam.Snapshot().world());
    EXPECT_EQ(result.state, fresh.Process(WithDetections(i)).state);
  }
  slam.Finish();
  fresh.Finish();
  ExpectSameMap(slam.Snapshot(), fresh.Snapshot());
  // An image without detections is not found by objects alone.
  slam.Reset();
  slam.Load(Path());
  EXPECT_EQ(slam.Process(WithoutDetections(30)).state, TrackingState::kLost);
  slam.SetRelocalizationMode(RelocalizationMode::kPoints);
  EXPECT_EQ(slam.Process(WithoutDetections(31)).state, TrackingState::kRelocalized);
}

TEST_F(SlamWithMap, ResetKeepsMappingOff) {
  Slam slam = MakeSlam();
  slam.SetMapping(false);
  slam.Reset();
  for (size_t i = 0; i < 40; ++i)
    EXPECT_EQ(slam.Process(WithDetections(i)).state, TrackingState::kInitializing);
  slam.SetMapping(true);
  for (size_t i = 40; i < 90; ++i) slam.Process(WithDetections(i));
  EXPECT_GT(slam.Snapshot().Keyframes().size(), 0U);
}

TEST_F(SlamWithMap, ASecondMapTakesThePlaceOfTheFirst) {
  Slam slam = MakeSlam();
  slam.Load(Path());
  for (size_t i = 20; i < 40; ++i) slam.Process(WithDetections(i));
  const size_t found = slam.Trajectory().size();
  EXPECT_GE(found, 18U);  // the newest may refer to a keyframe that is not yet in the map
  // If a file cannot be read, nothing changes.
  const std::string nothing = Path("nothing.map");
  EXPECT_INPUT_ERROR(slam.Load(nothing), HasSubstr("nothing.map"));
  EXPECT_EQ(slam.Trajectory().size(), found);
  EXPECT_EQ(slam.Process(WithDetections(40)).state, TrackingState::kTracking);
  // Time stamps and frame numbers begin anew, and the classes are those of the file.
  slam.SetClassNames({});
  slam.SetClassRelations({});
  slam.Load(Path());
  const TrackingResult result = slam.Process(WithDetections(5));
  EXPECT_EQ(result.frame, 0);
  EXPECT_EQ(result.state, TrackingState::kRelocalized);
  EXPECT_EQ(slam.Trajectory().size(), 1U);
  EXPECT_EQ(slam.Snapshot().CategoryNames(), (ClassNames{{1, "mine"}}));
  EXPECT_EQ(MapOf(slam.Snapshot())->classes, kRelations);
}

// Two files may contain maps of the same version.
TEST_F(SlamWithMap, ImagesAreLookedForInTheMapOfNow) {
  SavedMap desk = LoadMap(Path()), empty;
  empty.map.cameras = desk.map.cameras;
  empty.map.version = desk.map.version;
  SaveMap(Path("empty.map"), empty);
  Slam slam = MakeSlam();
  const auto find = [&] { return slam.Relocalize(WithoutDetections(30), kByPoints).evidence; };
  slam.Load(Path("empty.map"));
  EXPECT_EQ(find(), PoseEvidence::kNone);
  slam.Load(Path());
  EXPECT_EQ(find(), PoseEvidence::kPoints);
}

TEST_F(SlamWithMap, WithoutMappingAMapStaysAsItIs) {
  for (const bool before_load : {true, false}) {
    Slam slam = MakeSlam();
    if (before_load) slam.SetMapping(false);
    slam.Load(Path());
    if (!before_load) slam.SetMapping(false);
    const MapSnapshot before = slam.Snapshot();
    int tracked = 0;
    for (size_t i = 60; i < 150; ++i) {
      const TrackingResult result = slam.Process(WithDetections(i));
      tracked += result.state == TrackingState::kTracking;
    }
    EXPECT_GT(tracked, 80);
    slam.Finish();
    ExpectSameMap(slam.Snapshot(), before);
  }
  Slam maps = MakeSlam();
  maps.Load(Path());
  const MapSnapshot before = maps.Snapshot();
  for (size_t i = 60; i < 150; ++i) maps.Process(WithDetections(i));
  maps.Finish();
  EXPECT_NE(PlacesOf(maps.Snapshot()), PlacesOf(before));
}

TEST_F(SlamWithMap, SavesTheSubmapThatIsBeingMade) {
  Slam slam = MakeSlam();
  slam.Load(Path());
  for (size_t i = 30; i < 120; ++i) EXPECT_FALSE(slam.Process(Mirrored(i)).HasPose()) << i;
  slam.Save(Path("growing.map"));
  const SavedMap saved = LoadMap(Path("growing.map"));
  ASSERT_THAT(saved.submaps, SizeIs(1));
  EXPECT_EQ(saved.map.keyframes.size(), LoadMap(Path()).map.keyframes.size());

  Slam again = MakeSlam();
  again.Load(Path("growing.map"), 1);
  EXPECT_EQ(again.Snapshot().Keyframes().size(), saved.submaps[0].map.keyframes.size());
  EXPECT_TRUE(again.Relocalize(Mirrored(105), kByPoints).world_from_cam);
  EXPECT_FALSE(again.Relocalize(WithoutDetections(105), kByPoints).world_from_cam);
}

TEST_F(SlamWithMap, RefusesCamerasThatCannotBe) {
  const auto with = [](auto&& change) {
    Camera camera = clip().camera;
    change(camera);
    return InputErrorOf([&] { Slam(SlamConfig::Offline(), camera); });
  };
  EXPECT_THAT(with([](Camera& c) { c.cx = std::nan(""); }), HasSubstr("principal point cx"));
  EXPECT_THAT(with([](Camera& c) { c.fx = INFINITY; }), HasSubstr("focal length fx"));
  EXPECT_THAT(with([](Camera& c) { c.distortion[0] = std::nan(""); }), HasSubstr("distortion"));
  EXPECT_THAT(with([](Camera& c) { c.width = c.height = 1; }), HasSubstr("image width"));
  SlamConfig wrong = SlamConfig::Offline();
  wrong.features.count = -1;
  EXPECT_INPUT_ERROR(CameraEstimator{wrong}, HasSubstr("features.count"));
  CameraEstimationOptions start{.start = clip().camera};
  start.start->fx = std::nan("");
  EXPECT_INPUT_ERROR(CameraEstimator(SlamConfig::Offline(), start), HasSubstr("focal length fx"));
  for (const double mm : {std::nan(""), 0.0, -26.0, 1e9})
    EXPECT_INPUT_ERROR(CameraEstimator(SlamConfig::Offline(), {.focal_length_35mm = mm}),
                       HasSubstr("allowed: 2 to 3000 mm"));
}

TEST_F(SlamWithMap, RefusesModesThatAreNone) {
  constexpr auto kNone = static_cast<RelocalizationMode>(7);
  Slam slam = MakeSlam();
  slam.Load(Path());
  const MapLocalizer localizer(Path());
  const ImageInput input = WithDetections(30);
  const Camera& camera = clip().camera;
  for (const std::string& error :
       {InputErrorOf([&] { slam.Relocalize(input, {.mode = kNone}); }),
        InputErrorOf([&] { slam.Relocalize(input, {.mode = kNone, .unknown_camera = true}); }),
        InputErrorOf([&] { slam.SetRelocalizationMode(kNone); }),
        InputErrorOf([&] { localizer.Relocalize(input, {.mode = kNone, .camera = camera}); }),
        InputErrorOf([&] { localizer.Relocalize(input, {.mode = kNone}); })})
    EXPECT_THAT(error, HasSubstr("mode 7"));
}

// A time stamp or a direction of gravity that is not finite would spoil all that follows.
TEST_F(SlamWithMap, RefusesTimesAndGravityThatAreNotFinite) {
  Slam slam = MakeSlam();
  ImageInput input;
  input.timestamp = std::nan("");
  EXPECT_INPUT_ERROR(slam.Process(input), HasSubstr("time stamp"));
  const Eigen::Vector3d gravity(0, std::nan(""), 1);
  EXPECT_INPUT_ERROR(slam.Relocalize(input, {.follow = true}), HasSubstr("time stamp"));
  input.gravity_in_cam = gravity;
  for (const bool follow : {true, false})
    EXPECT_INPUT_ERROR(slam.Relocalize(input, {.follow = follow}), HasSubstr("gravity"));
}

TEST_F(SlamWithMap, FollowsByObjectsWhatItWasToldAndForgetsItWhenAsked) {
  Slam slam = MakeSlam();
  slam.Load(Path());
  const ImageInput first = WithDetections(30), second = WithDetections(31);
  const auto find = [&](double time, const ImageInput& boxes, bool follow) {
    return slam.Relocalize({.image = {}, .timestamp = time, .detections = boxes.detections},
                           {.follow = follow});
  };
  const RelocalizationResult alone = find(0, second, false);
  find(1, first, true);
  EXPECT_NE(find(1.03, second, true).object_score, alone.object_score);
  // An image that is refused changes nothing.
  EXPECT_INPUT_ERROR(find(1.03, first, true), HasSubstr("not after the one before"));
  slam.ForceRelocalization();
  EXPECT_EQ(find(1.06, second, true).object_score, alone.object_score);
  find(1.09, first, true);
  slam.Load(Path());
  EXPECT_EQ(find(1, second, true).object_score, alone.object_score);
  EXPECT_INPUT_ERROR(slam.Relocalize(first, {.follow = true}),
                     HasSubstr("only boxes are followed"));
}

TEST_F(SlamWithMap, TellsWhatHasGone) {
  Slam slam = MakeSlam();
  slam.SetMapping(false);
  slam.Load(Path());
  EXPECT_THAT(slam.Presence(), IsEmpty());
  for (size_t i = 0; i < 120; ++i) slam.Process(WithDetections(i));
  std::vector<ObjectPresence> presence = slam.Presence();
  const auto best = std::ranges::max_element(presence, {}, &ObjectPresence::seen);
  ASSERT_NE(best, presence.end());
  EXPECT_GT(best->seen, 80);
  EXPECT_LE(best->seen, best->expected);
  EXPECT_TRUE(std::ranges::none_of(presence, &ObjectPresence::is_missing));
  EXPECT_TRUE(std::ranges::is_sorted(presence, {}, &ObjectPresence::id));

  const ObjectId gone = best->id;
  const int category = best->category_id;
  // Counts of the map before do not count.
  slam.Load(Path());
  EXPECT_THAT(slam.Presence(), IsEmpty());
  for (size_t i = 0; i < 120; ++i) slam.Process(WithDetections(i, category));
  presence = slam.Presence();
  const auto found = std::ranges::find(presence, gone, &ObjectPresence::id);
  ASSERT_NE(found, presence.end());
  EXPECT_EQ(found->seen, 0);
  EXPECT_GT(found->expected, 80);
  EXPECT_TRUE(found->is_missing);
}

TEST_F(SlamWithMap, SaysWhyAnImageIsNotFound) {
  Slam slam = MakeSlam();
  slam.Load(Path());
  EXPECT_THAT(slam.Relocalize({}).why_not, HasSubstr("detections"));
  EXPECT_THAT(
      slam.Relocalize(WithoutDetections(30), {.mode = RelocalizationMode::kObjects}).why_not,
      HasSubstr("detections"));
}

}  // namespace
}  // namespace oaslam
