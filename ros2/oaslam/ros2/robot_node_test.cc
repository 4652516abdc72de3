#include "oaslam/ros2/robot_node.h"

#include <gmock/gmock.h>

#include "loopback.h"
#include "oaslam/error.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

constexpr int64_t kNanoseconds = 1'000'000'000, kStart = 1'700'000'000 * kNanoseconds;

CdrWriter& Head(CdrWriter& out, int64_t stamp, const char* frame) {
  return out.Put(static_cast<int32_t>(stamp / kNanoseconds))
      .Put(static_cast<uint32_t>(stamp % kNanoseconds))
      .Text(frame);
}

CdrWriter Image(int64_t stamp, uint8_t grey, const char* encoding = "mono8") {
  CdrWriter out;
  Head(out, stamp, "camera").Put(uint32_t{48}).Put(uint32_t{64}).Text(encoding).Put(uint8_t{0});
  out.Put(uint32_t{64}).Bytes(ByteBuffer(48 * 64, grey));
  return out;
}

CdrWriter Imu(int64_t stamp, double turn) {
  CdrWriter out;
  Head(out, stamp, "imu").All(std::array<double, 13>{});
  out.Vector({turn, 0, 0}).All(std::array<double, 9>{}).Vector({0, 0, 9.81});
  out.All(std::array<double, 9>{});
  return out;
}

// A camera, and the node that takes its images.
struct RobotNodes : testing::Test {
  const uint32_t domain = LoopbackDomain();
  DdsNode robot{domain};
  const int images = robot.Publish("/cam/image_raw", "sensor_msgs/Image", {}),
            infos = robot.Publish("/cam/camera_info", "sensor_msgs/CameraInfo", {}),
            imu = robot.Publish("/imu", "sensor_msgs/Imu", {}),
            frames = robot.Publish("/tf_static", "tf2_msgs/TFMessage",
                                   {.is_latched = true, .depth = 10});
  RobotOptions options{.names = {{{"image", "/cam/image_raw"}, {"imu", "/imu"}}, {}, {}},
                       .domain = domain};

  void Meet(const RobotNode&) {
    const double end = SteadySeconds() + kLoopbackPatience;
    for (const int topic : {images, infos, imu})
      while (robot.CountSubscribers(topic) == 0) {
        ASSERT_LT(SteadySeconds(), end);
        robot.Wait(0.01);
      }
  }
};

TEST_F(RobotNodes, TakeWhatARobotTells) {
  robot.Write(frames, TransformMessage({0, "base_link"}, "camera",
                                       {Rigid3::Rotation::Identity(), {1, 0, 0}})
                          .bytes());
  robot.Write(
      frames,
      TransformMessage({0, "base_link"}, "imu", {Rigid3::Rotation(0, 1, 0, 0), {0, 0, 1}}).bytes());
  RobotNode node(options);
  Meet(node);
  for (int i = 0; i < 20; ++i) robot.Write(imu, Imu(kStart + i * kNanoseconds / 20, i).bytes());
  const Camera camera{.width = 64, .height = 48, .fx = 50, .fy = 51, .cx = 31, .cy = 23};
  robot.Write(infos, CameraInfoMessage({kStart, "camera"}, {64, 48}, camera).bytes());
  robot.Write(images, Image(kStart + 123'456'789, 7).bytes());
  const std::optional<Camera> found = node.WaitForCamera();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->fy, 51);
  const auto source = node.OpenImages({});
  const std::optional<InputImage> image = source->Next();
  ASSERT_TRUE(image);
  EXPECT_EQ(image->image.size(), cv::Size(64, 48));
  EXPECT_EQ(image->image.at<uint8_t>(5, 5), 7);
  EXPECT_NEAR(image->timestamp, 1'700'000'000.123456789, 1e-6);
  ASSERT_TRUE(image->taken_s);

  const std::optional<Rigid3> cam_from_imu = node.WaitForImu();
  ASSERT_TRUE(cam_from_imu);
  EXPECT_LT((cam_from_imu->translation - Eigen::Vector3d(-1, 0, 1)).norm(), 1e-12);
  // As far as the offset between the clocks may be; each once.
  const std::vector<ImuSample> samples = node.TakeImu(image->timestamp);
  ASSERT_EQ(samples.size(), 8U);
  EXPECT_NEAR(samples[7].timestamp, 1'700'000'000.35, 1e-6);
  EXPECT_EQ(samples[7].angular_velocity.x(), 7);
  EXPECT_EQ(samples[7].acceleration.z(), 9.81);
  EXPECT_THAT(node.TakeImu(image->timestamp), testing::IsEmpty());
  source->Stop();
  EXPECT_FALSE(source->Next());
}

TEST_F(RobotNodes, ThePoseHasTheStampOfItsImage) {
  RobotNode node(options);
  std::vector<ByteBuffer> poses;
  robot.Read({"/oaslam/pose", "geometry_msgs/PoseWithCovarianceStamped", {}, {}}, {},
             [&](const RecordedMessage& m, uint64_t) {
               poses.emplace_back(m.data.begin(), m.data.end());
             });
  Meet(node);
  const double end = SteadySeconds() + kLoopbackPatience;
  while (robot.Publishers("/oaslam/pose").empty() && SteadySeconds() < end) robot.Wait(0.01);
  const int64_t stamp = kStart + 123'456'789;
  robot.Write(images, Image(stamp, 7).bytes());
  const auto source = node.OpenImages({});
  const std::optional<InputImage> image = source->Next();
  ASSERT_TRUE(image);
  node.Publish({.image = image->index,
                .frame = 3,
                .state = "tracking",
                .world = WorldId(1),
                .world_from_cam = Rigid3(),
                .map = std::make_shared<const Map>()},
               {});
  while (poses.empty() && SteadySeconds() < end) robot.Wait(0.01);
  ASSERT_EQ(poses.size(), 1U);
  const RecordedTopic topic{"/oaslam/pose", "sensor_msgs/Imu", MessageEncoding::kCdr, ""};
  const RosHeader header = ReadRosImu({&topic, 0, poses[0]}).header;
  EXPECT_EQ(header.stamp, stamp);
  EXPECT_EQ(header.frame, "map");
}

TEST_F(RobotNodes, RefuseDepthsAndLeaveOutDamagedImages) {
  RobotNode node(options);
  Meet(node);
  robot.Write(images, ByteBuffer{0, 1, 0, 0, 1, 2, 3, 4});
  robot.Write(images, Image(kStart, 1).bytes());
  const auto source = node.OpenImages({});
  EXPECT_TRUE(source->Next());
  for (int i = 1; i < 6; ++i)
    robot.Write(images, Image(kStart + i * kNanoseconds, 2, "16UC1").bytes());
  const auto of_depths = node.OpenImages({});
  EXPECT_THROW(of_depths->Next(), InputError);
}

}  // namespace
}  // namespace oaslam
