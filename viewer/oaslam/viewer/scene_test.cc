#include "oaslam/viewer/scene.h"

#include <opencv2/imgcodecs.hpp>

#include "matchers.h"
#include "message_reader.h"
#include "oaslam/geometry/camera_model.h"
#include "random_map.h"

namespace oaslam {
namespace {

using nlohmann::json;

// One mapped object in front of a camera at the origin.
Map MapWithCup() {
  Map map;
  map.cameras.push_back(
      {.width = 320, .height = 240, .fx = 300, .fy = 300, .cx = 159.5, .cy = 119.5});
  Keyframe keyframe;
  keyframe.features = std::make_shared<Features>();
  map.keyframes.Insert(KeyframeId(0), keyframe);
  Object cup;
  cup.category_id = 41;
  cup.state = ObjectState::kMapped;
  cup.ellipsoid = {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0.1, 0.2, 0.1),
                   Eigen::Quaterniond::Identity()};
  cup.total_observations = 50;
  cup.covariance.diagonal().setConstant(0.01);
  cup.observations.push_back({0, KeyframeId(0), {}, 0, Box{140, 90, 180, 150}, 0.9, 0});
  map.objects.Insert(ObjectId(7), cup);
  return map;
}

FrameRecord RecordOf(const std::shared_ptr<const Map>& map, int frame,
                     TrackingState state = TrackingState::kTracking) {
  FrameRecord record;
  record.result.frame = frame;
  record.result.timestamp = frame / 30.0;
  record.result.state = state;
  record.result.inliers = 120;
  record.result.ms_total = 8.5;
  if (state != TrackingState::kLost) record.result.SetPose(Rigid3());
  record.view.map = map;
  record.view.frame = {frame,
                       frame / 30.0,
                       std::make_shared<const Camera>(map->cameras.front()),
                       std::make_shared<Features>(),
                       {{41, 0.9, Box{140, 90, 180, 150}, 0}}};
  record.view.detected = {ObjectId(7)};
  record.view.pose = FramePose{frame, frame / 30.0, KeyframeId(0), {}, state};
  record.image = cv::Mat(240, 320, CV_8UC3, cv::Scalar(10, 20, 200));
  return record;
}

DecodedMessage NewsOf(Scene& scene, SceneCursor& cursor) {
  std::optional<std::string> news = scene.News(cursor);
  if (!news) throw std::logic_error("no news");
  return DecodedMessage(*news);
}

TEST(Scene, TellsEachViewerWhatItHasNotSeen) {
  const auto map = std::make_shared<const Map>(MapWithCup());
  Scene scene({{41, "cup"}});
  SceneCursor quick, slow;
  for (int i = 0; i < 10; ++i) {
    scene.Add(RecordOf(map, i));
    const DecodedMessage news = NewsOf(scene, quick);
    EXPECT_EQ(news.header["frame"]["frame"], i);
    EXPECT_THAT(news.Array<uint32_t>("note_frames"), ElementsAre(i));
    EXPECT_EQ(news.header.contains("map"), i == 0);
    EXPECT_EQ(scene.News(quick), std::nullopt);
  }
  const DecodedMessage all = NewsOf(scene, slow);
  EXPECT_THAT(all.Array<uint32_t>("note_frames"), SizeIs(10));
  EXPECT_THAT(all.Array<uint32_t>("path_frames"), SizeIs(10));
  EXPECT_EQ(all.header["frame"]["frame"], 9);
  EXPECT_THAT(all.header["objects"], SizeIs(1));
}

TEST(Scene, AFrameHasItsPictureBoxesAndEllipses) {
  const auto map = std::make_shared<const Map>(MapWithCup());
  Scene scene({{41, "cup"}});
  SceneCursor cursor;
  scene.Add(RecordOf(map, 0));
  const DecodedMessage news = NewsOf(scene, cursor);
  const json& frame = news.header["frame"];
  EXPECT_EQ(frame["detections"][0]["object"], 7);
  EXPECT_EQ(frame["detections"][0]["category"], "cup");
  ASSERT_THAT(frame["ellipses"], SizeIs(1));
  const json& ellipse = frame["ellipses"][0];
  EXPECT_NEAR(ellipse["center"][0].get<double>(), 159.5, 0.5);
  // 0.2 high at a distance of 2 with a focal length of 300; the outline of a sphere is a little
  // larger.
  EXPECT_NEAR(ellipse["half_axes"][0].get<double>(), 30, 1);
  EXPECT_NEAR(std::abs(ellipse["angle"].get<double>()), std::numbers::pi / 2, 1e-3);
  const cv::Mat picture = cv::imdecode(news.Array<uint8_t>("jpeg"), cv::IMREAD_COLOR);
  ASSERT_EQ(picture.size(), cv::Size(320, 240));
  EXPECT_NEAR(picture.at<cv::Vec3b>(120, 160)[2], 200, 8);
}

TEST(Scene, TellsTheRecordings) {
  Scene scene({});
  SceneCursor cursor;
  scene.SetStatus({.title = "a map", .recordings = {{"walk", "/films/walk.mp4", 0}, {"", "", 70}}});
  const json recordings = NewsOf(scene, cursor).header["status"]["recordings"];
  ASSERT_THAT(recordings, SizeIs(2));
  EXPECT_EQ(recordings[0]["name"], "walk");
  EXPECT_EQ(recordings[1]["first_frame"], 70);
}

TEST(Scene, SaysWhatHappened) {
  const auto map = std::make_shared<const Map>(MapWithCup());
  Scene scene({{41, "cup"}});
  SceneCursor cursor;
  const auto add = [&](int frame, TrackingState state, std::optional<Relocalization> found) {
    FrameRecord record = RecordOf(map, frame, state);
    record.view.relocalization = std::move(found);
    scene.Add(std::move(record));
  };
  add(0, TrackingState::kTracking, {});
  Relocalization lost, by_both;
  lost.why_not = "too few matches";
  by_both.evidence = PoseEvidence::kPointsAndObjects;
  by_both.confidence = 0.97;
  by_both.points.inliers = 80;
  by_both.objects.matched.resize(4);
  add(1, TrackingState::kLost, lost);
  add(2, TrackingState::kLost, lost);
  add(3, TrackingState::kRelocalized, by_both);
  const json events = NewsOf(scene, cursor).header["events"];
  ASSERT_THAT(events, SizeIs(2));
  EXPECT_EQ(events[0]["kind"], "lost");
  EXPECT_EQ(events[0]["text"], "too few matches");
  EXPECT_EQ(events[1]["kind"], "relocalized");
  EXPECT_EQ(events[1]["text"], "by points+objects: 80 points, 4 objects, confidence 0.97");
}

TEST(Scene, AnObjectHasItsHistoryAndCrops) {
  const auto map = std::make_shared<const Map>(MapWithCup());
  Scene scene({{41, "cup"}});
  for (int i = 0; i < 400; ++i) scene.Add(RecordOf(map, i));
  const DecodedMessage detail(*scene.DescribeObject(ObjectId(7)));
  EXPECT_EQ(detail.header["object"]["category"], "cup");
  EXPECT_THAT(detail.header["observations"], SizeIs(1));
  EXPECT_THAT(detail.header["covariance"], SizeIs(49));
  const json& crops = detail.header["crops"];
  ASSERT_THAT(crops, SizeIs(Crops::kMaxCrops));  // without any viewer
  EXPECT_EQ(crops.front()["frame"], 0);
  EXPECT_GT(crops.back()["frame"], 350);
  size_t bytes = 0;
  for (const json& crop : crops) bytes += crop["bytes"].get<size_t>();
  EXPECT_EQ(detail.Array<uint8_t>("jpegs").size(), bytes);
  EXPECT_EQ(scene.DescribeObject(ObjectId(8)), std::nullopt);
}

TEST(Scene, AResetStartsEveryViewerAnew) {
  Scene scene({});
  SceneCursor cursor;
  scene.Add(RecordOf(std::make_shared<const Map>(MapWithCup()), 0));
  NewsOf(scene, cursor);
  scene.Clear();
  EXPECT_TRUE(NewsOf(scene, cursor).header.contains("restart"));
  scene.Add(RecordOf(std::make_shared<const Map>(MapWithCup()), 1));
  const DecodedMessage news = NewsOf(scene, cursor);
  EXPECT_FALSE(news.header.contains("restart"));
  EXPECT_THAT(news.header["objects"], SizeIs(1));
  EXPECT_THAT(news.Array<uint32_t>("path_frames"), ElementsAre(1));
}

TEST(Scene, AKeyframeIsAFrame) {
  Scene scene({{41, "cup"}});
  scene.SetMap(std::make_shared<const Map>(MapWithCup()), {});
  const DecodedMessage before(*scene.DescribeKeyframe(KeyframeId(0)));
  EXPECT_THAT(before.Array<uint8_t>("jpeg"), IsEmpty());
  EXPECT_THAT(before.header["frame"]["ellipses"], SizeIs(1));
  EXPECT_EQ(before.header["frame"]["detections"][0]["object"], 7);
  scene.AddPicture(0, cv::Mat(240, 320, CV_8UC1, cv::Scalar(50)));
  EXPECT_GT(DecodedMessage(*scene.DescribeKeyframe(KeyframeId(0))).Array<uint8_t>("jpeg").size(),
            300U);
  EXPECT_THAT(DecodedMessage(*scene.DescribeObject(ObjectId(7))).header["crops"], SizeIs(1));
  EXPECT_EQ(scene.DescribeKeyframe(KeyframeId(1)), std::nullopt);
}

// A point of the scene is drawn where the tracker sees it, also with a lens that distorts.
TEST(IdealPictureMaker, UndistortsAsTheTrackerDoes) {
  Camera camera{.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240};
  camera.distortion = {-0.3, 0.1, 0, 0, 0};
  const Eigen::Vector2d pixel(560, 400);
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(0));
  image(cv::Rect(558, 398, 5, 5)) = 255;
  IdealPictureMaker maker(640);
  const cv::Mat picture = maker.Make(camera, image);
  const Eigen::Vector2d ideal = Undistort(camera, pixel);
  ASSERT_GT((ideal - pixel).norm(), 5);
  EXPECT_GT(picture.at<cv::Vec3b>(static_cast<int>(std::lround(ideal.y())),
                                  static_cast<int>(std::lround(ideal.x())))[0],
            200);
}

}  // namespace
}  // namespace oaslam
