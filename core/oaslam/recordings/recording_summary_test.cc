#include "oaslam/recordings/recording_summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "oaslam/recordings/topic_choice.h"
#include "recording_writer.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using Kind = MessageWriter::Kind;

constexpr int64_t kStart = 1'700'000'000'000'000'000;

std::string Image(int64_t stamp, const std::string& encoding = "mono8", Kind kind = Kind::kCdr,
                  const std::string& frame = "camera") {
  return MessageWriter(kind)
      .Header(stamp, frame)
      .Put(uint32_t{2})
      .Put(uint32_t{3})
      .Text(encoding)
      .Put(uint8_t{0})
      .Put(uint32_t{4})
      .Sequence("abc_def_")
      .Finish();
}

std::string CameraInfo(double focal, Kind kind = Kind::kCdr, uint32_t binning = 0) {
  return MessageWriter(kind)
      .Header(kStart, "camera")
      .Put(uint32_t{240})
      .Put(uint32_t{320})
      .Text("plumb_bob")
      .Put(uint32_t{5})
      .Doubles({0.1, -0.05, 1e-4, 2e-4, 0.01})
      .Doubles({focal, 0, 159.5, 0, focal + 1, 119.5, 0, 0, 1})
      .Doubles({1, 0, 0, 0, 1, 0, 0, 0, 1})
      .Doubles({focal / 2, 0, 150, 0, 0, focal / 2, 110, 0, 0, 0, 1, 0})
      .Put(binning)
      .Put(binning)
      .Put(uint32_t{0})
      .Put(uint32_t{0})
      .Put(uint32_t{0})
      .Put(uint32_t{0})
      .Put(uint8_t{0})
      .Finish();
}

std::string Imu(int64_t stamp, double rate, double acceleration, Kind kind = Kind::kCdr) {
  return MessageWriter(kind)
      .Header(stamp, "imu")
      .Zeros(4 + 9)
      .Doubles({rate, 0, 0})
      .Zeros(9)
      .Doubles({0, acceleration, 0})
      .Zeros(9)
      .Finish();
}

std::string Transform(const std::string& parent, const std::string& child, double x, double w,
                      double norm = 1) {
  return MessageWriter(Kind::kCdr)
      .Put(uint32_t{1})
      .Header(0, parent)
      .Text(child)
      .Doubles({x, 0, 0, 0, 0, norm * std::sqrt(1 - w * w), norm * w})
      .Finish();
}

std::string Detections(int64_t stamp) {
  return MessageWriter(Kind::kCdr)
      .Header(stamp, "camera")
      .Put(uint32_t{1})
      .Header(stamp, "camera")
      .Put(uint32_t{1})
      .Text("chair")
      .Put(0.75)
      .Zeros(7 + 36)
      .Doubles({100, 80, 0, 30, 20})
      .Text("")
      .Finish();
}

WrittenMessage Message(const std::string& topic, const std::string& type, const std::string& data) {
  return {topic, type, kStart + 8'000'000, data};
}

RecordingSummary SummaryOfAll(const std::vector<WrittenMessage>& messages) {
  static int number = 0;
  const TempFolder folder;
  return *SummaryOf(folder.Write(std::to_string(number++) + ".mcap", Mcap(messages, 2)));
}

template <typename Call>
std::string RefusalBy(Call call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "not refused";
}

TEST(RosMessages, AreTheSameInEveryEncoding) {
  for (const Kind kind : {Kind::kCdr, Kind::kBigEndianCdr, Kind::kRos1}) {
    RecordedTopic topic;
    topic.encoding = kind == Kind::kRos1 ? MessageEncoding::kRos1 : MessageEncoding::kCdr;
    const auto view = [&](const std::string& data) {
      return RecordedMessage{
          &topic, 0, {reinterpret_cast<const uint8_t*>(data.data()), data.size()}};
    };
    const std::string image_data = Image(kStart + 5, "mono8", kind, "/camera");
    const RosImage image = ReadRosImage(view(image_data), false);
    EXPECT_EQ(image.header.stamp, kStart + 5);
    EXPECT_EQ(image.header.frame, "camera");
    EXPECT_EQ(image.encoding, "mono8");
    EXPECT_EQ(image.width, 3U);
    EXPECT_EQ(std::string(image.data.begin(), image.data.end()), "abc_def_");
    const std::string info_data = CameraInfo(262.5, kind);
    const RosCameraInfo info = ReadRosCameraInfo(view(info_data));
    EXPECT_EQ(info.d[3], 2e-4);
    EXPECT_EQ(info.k[4], 263.5);
    EXPECT_EQ(info.p[6], 110);
    const std::string imu_data = Imu(kStart, 0.5, -9.8, kind);
    EXPECT_EQ(ReadRosImu(view(imu_data)).angular_velocity.x(), 0.5);
    EXPECT_EQ(ReadRosImu(view(imu_data)).acceleration.y(), -9.8);
    // Every message that ends early is refused.
    for (size_t size = 0; size + 1 < info_data.size() - 20; ++size)
      EXPECT_THROW(ReadRosCameraInfo(view(info_data.substr(0, size))), InputError) << size;
  }
}

TEST(RosMessages, OfOtherLayoutsAreRefused) {
  const std::string xcdr2 = std::string("\0\7\0\0", 4) + Image(kStart).substr(4);
  const RecordingSummary images = SummaryOfAll({Message("/image", "sensor_msgs/Image", xcdr2)});
  EXPECT_THAT(RefusalBy([&] { ChooseImages(images, ""); }),
              AllOf(HasSubstr("/image: sensor_msgs/Image"), HasSubstr("at byte "),
                    HasSubstr("a CDR of another kind"), HasSubstr("XCDR2")));
  const RecordingSummary summary = SummaryOfAll(
      {Message("/boxes", "vision_msgs/Detection2DArray", Detections(kStart) + "more of it")});
  EXPECT_THAT(summary.Find("boxes")->problem, HasSubstr("another version of vision_msgs"));
}

TEST(RecordingSummary, TellsWhatTopicsHave) {
  const RecordingSummary summary = SummaryOfAll(
      {Message("/a/image", "sensor_msgs/Image", Image(kStart)),
       Message("/a/image", "sensor_msgs/Image", Image(0)),
       Message("/a/camera_info", "sensor_msgs/CameraInfo", CameraInfo(0)),
       Message("/a/camera_info", "sensor_msgs/CameraInfo", CameraInfo(262.5)),
       Message("/imu", "sensor_msgs/Imu", Imu(kStart, 0.5, -9.8)),
       Message("/boxes", "vision_msgs/Detection2DArray", Detections(kStart)),
       Message("/tf_static", "tf2_msgs/TFMessage", Transform("base", "camera", 1, 1)),
       Message("/tf_static", "tf2_msgs/TFMessage", Transform("base", "arm", 0, 0.5, 0)),
       Message("/tf_static", "tf2_msgs/TFMessage", Transform("base", "imu", 3, std::sqrt(0.5)))});
  const TopicSummary& images = ChooseImages(summary, "");
  EXPECT_EQ(images.format, "mono8");
  EXPECT_EQ(images.frame, "camera");
  EXPECT_EQ(images.without_stamp, 1U);
  ASSERT_EQ(images.times.size(), 2U);
  EXPECT_NEAR(images.times[0], 1.7e9, 1e-6);
  EXPECT_NEAR(images.times[1], 1.7e9 + 0.008, 1e-6);  // when it was recorded
  const std::optional<Camera> camera = CameraOf(summary, images);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->fx, 262.5);
  EXPECT_EQ(camera->distortion[0], 0.1);
  EXPECT_EQ(ChooseImu(summary).accelerometer->accelerometer.values.at(0).y(), -9.8);
  ASSERT_EQ(summary.Find("/boxes")->detections.size(), 1U);
  const RosDetection& box = summary.Find("/boxes")->detections[0].detections.at(0);
  EXPECT_EQ(box.hypotheses.at(0).class_id, "chair");
  EXPECT_EQ(box.height, 20);
  const std::optional<Rigid3> cam_from_imu = summary.Between("camera", "imu");
  ASSERT_TRUE(cam_from_imu);
  EXPECT_TRUE((*cam_from_imu * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(2, 1, 0), 1e-9));
  EXPECT_FALSE(summary.Between("camera", "arm"));  // whose quaternion is none
  EXPECT_TRUE(summary.Between("arm", "arm"));
}

TEST(TopicChoice, AsksWhereThereAreSeveral) {
  const std::vector<WrittenMessage> two = {
      Message("/left/image", "sensor_msgs/Image", Image(kStart)),
      Message("/left/image/compressed", "sensor_msgs/CompressedImage",
              MessageWriter(Kind::kCdr).Header(0, "camera").Text("jpeg").Sequence("x").Finish()),
      Message("/depth", "sensor_msgs/Image", Image(kStart, "16UC1"))};
  const RecordingSummary one = SummaryOfAll(two);
  EXPECT_EQ(ChooseImages(one, "").topic.name, "/left/image");
  EXPECT_EQ(ChooseImages(one, "left/image/compressed").topic.name, "/left/image/compressed");
  // Both names are those of one camera.
  const RecordingSummary compressed = SummaryOfAll({two[1]});
  EXPECT_EQ(ChooseImages(compressed, "/left/image").topic.name, "/left/image/compressed");
  EXPECT_THAT(RefusalBy([&] { ChooseImages(one, "/depth"); }), HasSubstr("--depth"));
  EXPECT_THAT(RefusalBy([&] { ChooseImages(one, "/up"); }),
              AllOf(HasSubstr("--topic /up: is not there"), HasSubstr("/left/image")));
  std::vector<WrittenMessage> three = two;
  three.push_back(Message("/right/image", "sensor_msgs/Image", Image(kStart)));
  EXPECT_THAT(RefusalBy([&] { ChooseImages(SummaryOfAll(three), ""); }),
              AllOf(HasSubstr("2 topics of images, --topic NAME"), HasSubstr("/left/image:"),
                    HasSubstr("/right/image:")));
  EXPECT_EQ(ChooseDepths(one, ChooseImages(one, ""))->topic.name, "/depth");
}

TEST(CameraOfInfo, TakesPOfRectifiedImages) {
  const RecordingSummary summary = SummaryOfAll(
      {Message("/a/image_rect", "sensor_msgs/Image", Image(kStart)),
       Message("/a/camera_info", "sensor_msgs/CameraInfo", CameraInfo(262.5)),
       Message("/b/image_raw", "sensor_msgs/Image", Image(kStart)),
       Message("/b/camera_info", "sensor_msgs/CameraInfo", CameraInfo(0)),
       Message("/c/image_raw", "sensor_msgs/Image", Image(kStart)),
       Message("/c/camera_info", "sensor_msgs/CameraInfo", CameraInfo(262.5, Kind::kCdr, 2))});
  const std::optional<Camera> camera = CameraOf(summary, *summary.Find("/a/image_rect"));
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->fx, 131.25);
  EXPECT_EQ(camera->cx, 150);
  EXPECT_FALSE(camera->HasDistortion());
  EXPECT_FALSE(CameraOf(summary, *summary.Find("/b/image_raw")));
  EXPECT_THAT(RefusalBy([&] { CameraOf(summary, *summary.Find("/c/image_raw")); }),
              HasSubstr("/c/camera_info: binning: 2 x 2"));
}

TEST(ChooseImu, JoinsASensorEach) {
  const RecordingSummary summary =
      SummaryOfAll({Message("/gyro", "sensor_msgs/Imu", Imu(kStart, 0.5, 0)),
                    Message("/accel", "sensor_msgs/Imu", Imu(kStart, 0, 9.8))});
  const ImuTopics imu = ChooseImu(summary);
  ASSERT_TRUE(imu.gyroscope && imu.accelerometer);
  EXPECT_EQ(imu.gyroscope->topic.name, "/gyro");
  EXPECT_EQ(imu.accelerometer->topic.name, "/accel");
}

}  // namespace
}  // namespace oaslam
