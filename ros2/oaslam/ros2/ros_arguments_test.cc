#include "oaslam/ros2/ros_arguments.h"

#include <gmock/gmock.h>

#include "oaslam/error.h"

namespace oaslam {
namespace {

using testing::ElementsAre;

RosArguments Parse(const std::vector<std::string>& arguments) {
  return ParseRosArguments(arguments, {"image", "pose", "tf"});
}

TEST(RosArguments, AreThoseOfNodes) {
  const RosArguments found =
      Parse({"image:=/cam/image_raw", "--out", "lab", "--ros-args", "-r", "~/pose:=where", "-p",
             "use_sim_time:=true", "--log-level", "info", "--", "--quiet"});
  EXPECT_EQ(found.TopicOf("image"), "/cam/image_raw");
  EXPECT_EQ(found.TopicOf("~/pose"), "/where");
  EXPECT_EQ(found.TopicOf("~/path"), "/oaslam/path");
  EXPECT_EQ(found.TopicOf("/tf"), "/tf");
  EXPECT_THAT(found.others, ElementsAre("--out", "lab", "--quiet"));
  EXPECT_THAT(found.ignored, ElementsAre("use_sim_time:=true", "--log-level", "info"));
}

TEST(RosArguments, HaveANamespace) {
  const RosArguments found = Parse({"__ns:=/robot1", "__node:=slam", "tf:=/robot1/tf"});
  EXPECT_EQ(found.TopicOf("image"), "/robot1/image");
  EXPECT_EQ(found.TopicOf("~/pose"), "/robot1/slam/pose");
  EXPECT_EQ(found.TopicOf("/tf"), "/robot1/tf");
}

TEST(RosArguments, RefuseOtherNames) {
  EXPECT_THROW(Parse({"imag:=/cam/image_raw"}), InputError);
  EXPECT_THROW(Parse({"image:=/cam/image raw"}), InputError);
  EXPECT_THROW(Parse({"image:="}), InputError);
}

}  // namespace
}  // namespace oaslam
