#include "oaslam/exports/result_recording.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "expect_input_error.h"
#include "folder_test.h"
#include "full_disk.h"
#include "oaslam/exports/map_export.h"
#include "oaslam/exports/result_messages.h"
#include "oaslam/formats/text.h"
#include "oaslam/recordings/recording_reader.h"
#include "oaslam/recordings/ros_definitions.h"
#include "random_map.h"

namespace oaslam {
namespace {

using nlohmann::json;

// A message of ROS 2 by its definition.
class Decoder {
 public:
  Decoder(const std::string& type, ByteView message) : in_(message.subspan(4), "message") {
    std::string name = type;
    const std::string definition = RosDefinition(type);
    for (const std::string_view line : SplitLines(definition)) {
      if (line.starts_with("MSG: "))
        name = line.substr(5);
      else if (!line.starts_with("="))
        fields_[name].emplace_back(line);
    }
    value = Read(type);
    EXPECT_EQ(in_.left(), 0U) << type;
  }

  json value;

 private:
  template <typename T>
  T Get() {
    in_.Skip((sizeof(T) - in_.at() % sizeof(T)) % sizeof(T));
    return in_.Get<T>();
  }
  json Read(const std::string& type) {
    if (const size_t bracket = type.find('['); bracket != std::string::npos) {
      const std::string element = type.substr(0, bracket), count = type.substr(bracket + 1);
      json all = json::array();
      for (size_t n = count == "]" ? Get<uint32_t>() : std::stoul(count); n > 0; --n)
        all.push_back(Read(element));
      return all;
    }
    if (type == "float64") return Get<double>();
    if (type == "float32") return Get<float>();
    if (type == "int32") return Get<int32_t>();
    if (type == "uint32") return Get<uint32_t>();
    if (type == "uint8" || type == "bool") return Get<uint8_t>();
    if (type == "string") {
      Get<uint32_t>(), in_.GoBack(4);
      return std::string(in_.Text().c_str());
    }
    json object;
    for (const std::string& line : fields_.at(type)) {
      const auto field = SplitFields(line);
      object[std::string(field[1])] = Read(std::string(field[0]));
    }
    return object;
  }

  std::map<std::string, std::vector<std::string>> fields_;
  RecordBytes in_;
};

using Messages = std::map<std::string, std::vector<json>>;

Messages ReadAll(const std::string& path) {
  Messages messages;
  const auto reader = OpenRecording(path, [](const RecordedTopic&) { return kWholeMessage; });
  while (const auto m = reader->Next())
    messages[m->topic->name].push_back(Decoder(m->topic->type, m->data).value);
  EXPECT_EQ(reader->problem(), "");
  return messages;
}

Eigen::Vector3d Vector(const json& v) {
  return {v["x"].get<double>(), v["y"].get<double>(), v["z"].get<double>()};
}
Eigen::Quaterniond Rotation(const json& q) {
  return {q["w"].get<double>(), q["x"].get<double>(), q["y"].get<double>(), q["z"].get<double>()};
}
std::vector<std::string> Texts(const std::vector<json>& events) {
  std::vector<std::string> texts;
  for (const json& event : events) texts.push_back(event["msg"]);
  return texts;
}

struct ResultRecordings : FolderTest {
  const std::string path = folder / "a.mcap";
  SavedMap saved = [] {
    Rng rng(7);
    return RandomMap({}, rng);
  }();
  RecordedResult result = {.timestamp = 1'700'000'000.25,
                           .state = "tracking",
                           .world = WorldId(3),
                           .world_from_cam = Rigid3(Rigid3::Rotation(0.8, 0, 0.6, 0), {1, 2, 3}),
                           .map = &saved.map,
                           .camera = {.width = 8, .height = 6, .fx = 5, .fy = 6, .cx = 3, .cy = 2},
                           .picture = cv::Mat(6, 8, CV_8UC3, cv::Scalar(9, 99, 200))};

  Messages Record(const std::vector<RecordedResult>& results) {
    ResultRecording recording(path);
    for (const RecordedResult& r : results) recording.Add(r, saved.class_names);
    recording.Finish();
    return ReadAll(path);
  }
};

TEST_F(ResultRecordings, HaveWhatWasFound) {
  Map& map = saved.map;
  map.up = Eigen::Vector3d(0.1, -1, 0.2).normalized();
  result.covariance.diagonal() << 1, 2, 3, 4, 5, 6;
  result.covariance(0, 4) = result.covariance(4, 0) = 0.5;
  result.detections = {{.category_id = 41, .score = 0.75, .box = {1, 2, 5, 4}}};
  const Messages all = Record({result});

  // The map is turned to z up, and the first camera looks along x.
  const json& pose = all.at("/oaslam/pose").at(0);
  EXPECT_EQ(
      pose["header"],
      json::parse(R"({"stamp": {"sec": 1700000000, "nanosec": 250000000}, "frame_id": "map"})"));
  const Eigen::Matrix3d turn = RosFromWorld(map).toRotationMatrix();
  EXPECT_LT((turn * *map.up - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  const Rigid3 first = map.keyframes.At(map.keyframes.Ids().front()).cam_from_world.Inverse();
  const Eigen::Vector3d right = turn * (first.rotation * Eigen::Vector3d::UnitX());
  EXPECT_LT(right.y(), 0);
  EXPECT_NEAR(right.x(), 0, 1e-9);
  EXPECT_LT((Vector(pose["pose"]["pose"]["position"]) - turn * Eigen::Vector3d(1, 2, 3)).norm(),
            1e-9);
  const Eigen::Matrix3d from_cam = turn * result.world_from_cam->rotation.toRotationMatrix();
  EXPECT_LT((Rotation(pose["pose"]["pose"]["orientation"]).toRotationMatrix() - from_cam).norm(),
            1e-9);
  // A spread along an axis of the camera is one along that axis in the map.
  const std::vector<double> numbers = pose["pose"]["covariance"];
  const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> covariance(numbers.data());
  const Eigen::Matrix3d position = covariance.topLeftCorner<3, 3>();
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT((position * from_cam.col(i) - (i + 1) * from_cam.col(i)).norm(), 1e-9);
    EXPECT_NEAR(from_cam.col(i).dot(covariance.bottomRightCorner<3, 3>() * from_cam.col(i)), i + 4,
                1e-9);
  }
  EXPECT_NEAR(from_cam.col(0).dot(covariance.topRightCorner<3, 3>() * from_cam.col(1)), 0.5, 1e-9);

  const json& transform = all.at("/tf").at(0)["transforms"].at(0);
  EXPECT_EQ(transform["header"], pose["header"]);
  EXPECT_EQ(transform["child_frame_id"], "camera_optical_frame");
  EXPECT_EQ(transform["transform"]["translation"], pose["pose"]["pose"]["position"]);
  EXPECT_EQ(transform["transform"]["rotation"], pose["pose"]["pose"]["orientation"]);
  EXPECT_EQ(all.at("/oaslam/path").at(0)["poses"].size(), map.keyframes.size());

  const json& cloud = all.at("/oaslam/landmarks").at(0);
  const std::vector<uint8_t> points = cloud["data"];
  ASSERT_EQ(points.size(), 12 * map.landmarks.size());
  EXPECT_EQ(cloud["width"], map.landmarks.size());
  Eigen::Vector3f point;
  std::memcpy(point.data(), points.data(), 12);
  const Eigen::Vector3d at = turn * map.landmarks.At(map.landmarks.Ids().front()).position;
  EXPECT_LT((point.cast<double>() - at).norm(), 1e-5);
  EXPECT_EQ(cloud["fields"].at(2),
            json::parse(R"({"name": "z", "offset": 8, "datatype": 7, "count": 1})"));

  const json& picture = all.at("/oaslam/image/compressed").at(0);
  const cv::Mat decoded =
      cv::imdecode(picture["data"].get<std::vector<uint8_t>>(), cv::IMREAD_COLOR);
  EXPECT_EQ(decoded.size(), cv::Size(8, 6));
  EXPECT_EQ(picture["header"]["frame_id"], "camera_optical_frame");
  const json& info = all.at("/oaslam/camera_info").at(0);
  EXPECT_EQ(info["k"], json({5.0, 0.0, 3.0, 0.0, 6.0, 2.0, 0.0, 0.0, 1.0}));
  EXPECT_EQ(info["width"], 8);
  const json& box = all.at("/oaslam/detections").at(0)["detections"].at(0);
  EXPECT_EQ(
      box["bbox"],
      json::parse(
          R"({"center": {"position": {"x": 3.0, "y": 3.0}, "theta": 0.0}, "size_x": 4.0, "size_y": 2.0})"));
  EXPECT_EQ(box["results"].at(0)["hypothesis"]["score"], 0.75);
  EXPECT_EQ(Texts(all.at("/oaslam/events")), std::vector<std::string>{"tracking"});
}

TEST_F(ResultRecordings, HaveTheObjects) {
  Map& map = saved.map;
  const std::vector<ObjectId> ids = map.objects.Ids();
  for (const ObjectId id : ids) map.objects.MutableAt(id).state = ObjectState::kTentative;
  Object& object = map.objects.MutableAt(ids[1]);
  object.state = ObjectState::kMapped;
  object.category_id = 41;
  object.name = "mine";
  object.shares.clear();
  saved.class_names[41] = "cup";
  const Messages all = Record({result});
  const Eigen::Matrix3d turn = RosFromWorld(map).toRotationMatrix();
  const json& markers = all.at("/oaslam/objects").at(0)["markers"];
  ASSERT_EQ(markers.size(), 3U);
  EXPECT_EQ(markers[0]["action"], 3);
  EXPECT_EQ(markers[1]["type"], 2);
  EXPECT_EQ(markers[2]["type"], 9);
  EXPECT_EQ(markers[2]["text"], "mine");
  EXPECT_EQ(Vector(markers[1]["scale"]), 2 * object.ellipsoid.half_axes);
  EXPECT_LT((Vector(markers[1]["pose"]["position"]) - turn * object.ellipsoid.center).norm(), 1e-9);
  const json& found = all.at("/oaslam/objects_3d").at(0)["detections"].at(0);
  EXPECT_EQ(found["results"][0]["hypothesis"], json::parse(R"({"class_id": "cup", "score": 1.0})"));
  EXPECT_EQ(found["id"], ToString(ids[1]));
  EXPECT_EQ(found["bbox"]["center"], markers[1]["pose"]);
  const Eigen::Matrix3d axes = Rotation(found["bbox"]["center"]["orientation"]).toRotationMatrix();
  EXPECT_LT((axes - turn * object.ellipsoid.rotation.toRotationMatrix()).norm(), 1e-9);
}

TEST_F(ResultRecordings, WriteTheMapOnceASecond) {
  std::vector<RecordedResult> results;
  std::vector<Map> maps(40, saved.map);
  for (size_t i = 0; i < maps.size(); ++i) {
    maps[i].version = i < 25 ? i : 24;
    result.timestamp = 100 + 0.1 * static_cast<double>(i);
    result.map = &maps[i];
    results.push_back(result);
  }
  const Messages all = Record(results);
  std::vector<double> times;
  for (const json& written : all.at("/oaslam/path")) {
    const json& stamp = written["header"]["stamp"];
    times.push_back(stamp["sec"].get<double>() + stamp["nanosec"].get<double>() * 1e-9);
  }
  // When it has changed; the last change is written, too.
  EXPECT_THAT(times,
              testing::ElementsAre(testing::DoubleNear(100, 1e-6), testing::DoubleNear(101, 0.11),
                                   testing::DoubleNear(102, 0.21), testing::DoubleNear(103, 0.31)));
  EXPECT_EQ(all.at("/oaslam/landmarks").size(), times.size());
  EXPECT_EQ(all.at("/tf").size(), maps.size());
}

TEST_F(ResultRecordings, TellEvents) {
  std::vector<RecordedResult> results(6, result);
  Map looped = saved.map, other = saved.map;
  saved.map.up = -Eigen::Vector3d::UnitY();
  looped.up = Eigen::Vector3d(0, -1, 0.1).normalized();
  looped.loops_closed = saved.map.loops_closed + 1;
  for (size_t i = 0; i < results.size(); ++i) results[i].timestamp += 0.01 * static_cast<double>(i);
  results[1].state = "lost", results[1].is_lost = true, results[1].world_from_cam.reset();
  results[2] = results[1], results[2].events = {"a submap grows"};
  results[3].events = {"joined"};
  // A joined submap has loops of its own: their number tells of none that was closed.
  results[4].map = &looped, results[4].events = {"corrected"};
  results[5].world = WorldId(9), results[5].map = &other;
  const Messages all = Record(results);
  const std::vector<std::string> texts = Texts(all.at("/oaslam/events"));
  EXPECT_THAT(texts,
              testing::ElementsAre("tracking", "lost", "a submap grows", "tracking", "joined",
                                   "corrected", testing::HasSubstr("turned by 5.7 degrees"),
                                   testing::HasSubstr("another unit: world 9")));
  EXPECT_EQ(all.at("/oaslam/events")[1]["level"], 30);
  // After an event, and where it is another map, it is written at once.
  EXPECT_EQ(all.at("/oaslam/path").size(), 5U);
  EXPECT_EQ(all.at("/tf").size(), 4U);
  EXPECT_EQ(all.at("/oaslam/image/compressed").size(), 6U);
}

TEST_F(ResultRecordings, ASavedMapIsOneToo) {
  saved.trajectory.clear();
  ExportMcap(path, saved);
  const Messages all = ReadAll(path);
  EXPECT_EQ(all.at("/tf").size(), saved.map.keyframes.size());
  EXPECT_EQ(all.at("/oaslam/path").at(0)["poses"].size(), saved.map.keyframes.size());
  EXPECT_EQ(all.at("/oaslam/landmarks").at(0)["width"], saved.map.landmarks.size());
  EXPECT_FALSE(all.contains("/oaslam/pose"));
}

TEST_F(ResultRecordings, ASavedMapThatFindsNoRoomLeavesTheFormerFile) {
  ExportMcap(path, saved);
  const std::string before = folder.Read("a.mcap");
  saved.map.landmarks = {};
  {
    const FullDisk full(1000);
    EXPECT_INPUT_ERROR(ExportMcap(path, saved), testing::StartsWith(path + ": cannot be written"));
  }
  EXPECT_EQ(folder.Read("a.mcap"), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
  ExportMcap(path, saved);
  EXPECT_NE(folder.Read("a.mcap"), before);
}

TEST(ResultMessages, AreInTheLayoutOfRos) {
  RosTwist twist{.linear = {1, 2, 3}, .angular = {4, 5, 6}};
  twist.covariance(0, 5) = 0.5;
  RosCovariance covariance = RosCovariance::Zero();
  covariance(1, 0) = 0.25;
  const json odometry =
      Decoder("nav_msgs/Odometry",
              OdometryMessage({1'700'000'000'000'000'007, "map"}, "base_link",
                              {Rigid3::Rotation(0.8, 0, 0.6, 0), {7, 8, 9}}, covariance, twist)
                  .bytes())
          .value;
  EXPECT_EQ(odometry["header"]["stamp"], json::parse(R"({"sec": 1700000000, "nanosec": 7})"));
  EXPECT_EQ(odometry["child_frame_id"], "base_link");
  EXPECT_EQ(Vector(odometry["pose"]["pose"]["position"]), Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(odometry["pose"]["covariance"][6], 0.25);
  EXPECT_EQ(Vector(odometry["twist"]["twist"]["angular"]), twist.angular);
  EXPECT_EQ(odometry["twist"]["covariance"][5], 0.5);

  const json status =
      Decoder("diagnostic_msgs/DiagnosticArray",
              DiagnosticsMessage(5, {{Diagnostic::kWarning, "a", "bc", {{"k", "v"}, {"", "w"}}}})
                  .bytes())
          .value;
  EXPECT_EQ(status["status"][0], json::parse(R"({"level": 1, "name": "a", "message": "bc",
    "hardware_id": "", "values": [{"key": "k", "value": "v"}, {"key": "", "value": "w"}]})"));
}

}  // namespace
}  // namespace oaslam
