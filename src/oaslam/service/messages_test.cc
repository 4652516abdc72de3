#include "oaslam/service/messages.h"

#include "expect_input_error.h"

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

}  // namespace
}  // namespace oaslam
