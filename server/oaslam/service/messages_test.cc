#include "oaslam/service/messages.h"

#include "expect_input_error.h"
#include "oaslam/service/received_features.h"

namespace oaslam {
namespace {

ImageRequest RequestOf(const std::string& text) {
  const nlohmann::json read = nlohmann::json::parse(text);
  return ReadImageRequest(JsonInput(read, "header"));
}

TEST(Messages, AGyroscopeComesWithAnImage) {
  EXPECT_THAT(RequestOf("{}").angular_velocity, SizeIs(0));
  const auto samples =
      RequestOf(R"({"angular_velocity": [[1.5, 0, -1, 2], [1.51, 0.1, 0, 0]]})").angular_velocity;
  ASSERT_THAT(samples, SizeIs(2));
  EXPECT_EQ(samples[0].timestamp, 1.5);
  EXPECT_EQ(samples[0].in_cam, Eigen::Vector3d(0, -1, 2));
  EXPECT_INPUT_ERROR(RequestOf(R"({"angular_velocity": [[1.5, 0, -1]]})"),
                     HasSubstrs("header.angular_velocity[0]", "4"));
  EXPECT_INPUT_ERROR(RequestOf(R"({"angular_velocity": [[1.5, 0, -1, "2"]]})"),
                     HasSubstr("header.angular_velocity[0][3]"));
}

TEST(Messages, AnImuComesWithAnImage) {
  EXPECT_FALSE(RequestOf("{}").cam_from_imu);
  const ImageRequest request = RequestOf(
      R"({"imu": [[1.5, 0, -1, 2, 3, 4, 5]],
        "cam_from_imu": {"position": [0.1, 0, 0], "rotation": [0, 0, 0, 1]}})");
  const ImageInput input = ImageInputOf(request);
  ASSERT_THAT(input.imu, SizeIs(1));
  EXPECT_EQ(input.imu[0].timestamp, 1.5);
  EXPECT_EQ(input.imu[0].angular_velocity, Eigen::Vector3d(0, -1, 2));
  EXPECT_EQ(input.imu[0].acceleration, Eigen::Vector3d(3, 4, 5));
  EXPECT_EQ(request.cam_from_imu->translation, Eigen::Vector3d(0.1, 0, 0));
  std::optional<Rigid3> known;
  EXPECT_FALSE(TakeImuPose(RequestOf("{}"), known));
  EXPECT_TRUE(TakeImuPose(request, known));
  EXPECT_FALSE(TakeImuPose(request, known));
  EXPECT_EQ(known->translation.x(), 0.1);
  EXPECT_INPUT_ERROR(RequestOf(R"({"imu": [[1.5, 0, -1, 2]]})"), HasSubstrs("header.imu[0]", "7"));
  EXPECT_INPUT_ERROR(RequestOf(R"({"cam_from_imu": 1})"), HasSubstr("header.cam_from_imu"));
}

TEST(Messages, TheMotionOfTheDeviceComesWithAnImage) {
  EXPECT_FALSE(RequestOf("{}").motion);
  EXPECT_FALSE(RequestOf(R"({"motion": null})").motion->is_known);
  const MotionInput motion =
      *RequestOf(R"({"motion": {"run": 1, "image": 9, "keyframe": true, "agreeing": 0.5,
        "pose": {"position": [1, 2, 3], "rotation": [0, 0, 0, 1]},
        "keyframes": [[4, 1, 0, 0, 0, 0, 1, 0], [8, 2, 0, 0, 0, 0, 0, 1]],
        "depths": [[320.5, 10, 0.25]]}})")
           .motion;
  EXPECT_TRUE(motion.is_known);
  EXPECT_EQ(motion.run, 1);
  EXPECT_EQ(motion.image, 9);
  EXPECT_TRUE(motion.is_keyframe);
  EXPECT_FALSE(motion.is_preliminary);
  EXPECT_EQ(motion.agreeing, 0.5);
  EXPECT_EQ(motion.odom_from_cam.translation, Eigen::Vector3d(1, 2, 3));
  ASSERT_THAT(motion.corrected, SizeIs(2));
  EXPECT_EQ(motion.corrected[0].image, 4);
  EXPECT_EQ(motion.corrected[0].odom_from_cam.rotation.z(), 1);
  EXPECT_EQ(motion.corrected[1].odom_from_cam.translation.x(), 2);
  ASSERT_THAT(motion.depths, SizeIs(1));
  EXPECT_EQ(motion.depths[0].pixel.x(), 320.5);
  EXPECT_EQ(motion.depths[0].inverse_depth, 0.25);
  EXPECT_INPUT_ERROR(RequestOf(R"({"motion": {"run": 1}})"), HasSubstr("header.motion"));
  EXPECT_INPUT_ERROR(RequestOf(R"({"motion": 3})"), HasSubstr("header.motion"));
}

TEST(Messages, KeyPointsComeInsteadOfAnImage) {
  const std::string points = R"("features": {"count": 2, "lowest": 1, "levels": 8, "factor": 1.2})";
  const ImageRequest request =
      RequestOf(R"({"camera": {"width": 640, "height": 480, "fx": 500}, )" + points + "}");
  EXPECT_EQ(request.feature_count, 2);
  EXPECT_EQ(request.features->levels, 8);
  EXPECT_EQ(request.features->factor, 1.2);
  EXPECT_INPUT_ERROR(RequestOf("{" + points + "}"), HasSubstr("header: camera"));
  EXPECT_INPUT_ERROR(RequestOf(R"({"features": {"count": -1}})"), HasSubstr("count"));
}

TEST(Messages, KeyPointsHaveTheirPlacesThenLevelsThenDescriptors) {
  std::string bytes;
  const auto add = [&](auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (const float number : {1.5F, 2.5F, 0.5F, 3.5F, 4.5F, 6.0F}) add(number);
  for (const int level : {3, 7}) add(static_cast<uint8_t>(level));
  for (const uint64_t word : {1, 2, 3, 4, 5, 6, 7, 8}) add(word);
  const std::vector<ImageFeature> features = ReadReceivedFeatures(bytes, 2);
  ASSERT_THAT(features, SizeIs(2));
  EXPECT_EQ(features[0].pixel, Eigen::Vector2f(1.5F, 2.5F));
  EXPECT_EQ(features[1].angle_rad, 6);
  EXPECT_EQ(features[1].level, 7);
  EXPECT_EQ(features[1].descriptor[3], 8u);
  EXPECT_THAT(ReadReceivedFeatures("", 0), SizeIs(0));
  EXPECT_INPUT_ERROR(ReadReceivedFeatures(bytes, 3), HasSubstrs("90 bytes", "135"));
}

}  // namespace
}  // namespace oaslam
