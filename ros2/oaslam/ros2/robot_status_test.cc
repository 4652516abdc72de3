#include "oaslam/ros2/robot_status.h"

#include <gmock/gmock.h>

namespace oaslam {
namespace {

using Known = RobotStatus::Known;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const RobotStatus kGood = {.image_topic = "/camera/image_raw",
                           .publishers = 1,
                           .images = 1000,
                           .silence_s = 0.03,
                           .state = "tracking",
                           .has_result = true,
                           .has_pose = true,
                           .is_metric = true,
                           .camera = "camera",
                           .base_from_camera = Known::kNow,
                           .odom_from_base = Known::kNow};

TEST(RobotStatus, IsQuietWhereAllIsWell) {
  EXPECT_THAT(ProblemsOf(kGood), IsEmpty());
  const Diagnostic found = DiagnosticOf(kGood);
  EXPECT_EQ(found.level, Diagnostic::kOk);
  EXPECT_EQ(found.message, "tracking");
}

TEST(RobotStatus, TellsWhichTopicsThereAre) {
  RobotStatus status{.image_topic = "/image"};
  EXPECT_THAT(ProblemsOf(status),
              ElementsAre(HasSubstr("nobody else publishes anything that is seen here: ROS")));
  status.publications = {{"/scan", "sensor_msgs/LaserScan", true}};
  EXPECT_THAT(ProblemsOf(status), ElementsAre(HasSubstr("none of the 1 publishers seen has")));
  status.publications.push_back({"/cam/image_raw", "sensor_msgs/Image", true});
  EXPECT_THAT(ProblemsOf(status),
              ElementsAre("nobody publishes images on /image; topics of images: /cam/image_raw "
                          "(sensor_msgs/Image); image:=TOPIC takes another"));
  EXPECT_EQ(DiagnosticOf(status).level, Diagnostic::kError);
}

TEST(RobotStatus, TellsWhatIsWrongWithImages) {
  RobotStatus status = kGood;
  status.publishers = 2;
  status.missed = 80;
  status.without_stamp = 4;
  status.out_of_order = 90;
  EXPECT_THAT(ProblemsOf(status),
              ElementsAre(HasSubstr("has 2 publishers"), HasSubstr("4 images have no time stamp"),
                          HasSubstr("90 images are not later"), HasSubstr("net.core.rmem_max")));
  EXPECT_EQ(DiagnosticOf(status).level, Diagnostic::kWarning);
  status = kGood;
  status.recent_images = 4;
  status.recent_infos = 120;
  EXPECT_THAT(ProblemsOf(status), ElementsAre(HasSubstr("4 images came with 120 CameraInfos")));
  status = kGood;
  status.missed = 30;
  EXPECT_THAT(ProblemsOf(status), IsEmpty());
  status.silence_s = 61;
  EXPECT_THAT(ProblemsOf(status),
              ElementsAre(testing::StartsWith(
                  "/camera/image_raw has a publisher, but no image has come for 61 s; if all")));
  EXPECT_EQ(DiagnosticOf(status).level, Diagnostic::kError);
  EXPECT_THAT(DiagnosticOf(status).message, testing::StartsWith("no images; "));
}

TEST(RobotStatus, TellsThatTheCameraIsTurned) {
  RobotStatus status = kGood;
  status.has_optical_axes = false;
  EXPECT_THAT(ProblemsOf(status), ElementsAre(HasSubstr("turned by 90 degrees")));
}

TEST(RobotStatus, TellsWhyThereIsNoOdom) {
  RobotStatus status = kGood;
  status.base_from_camera = Known::kNot;
  EXPECT_THAT(ProblemsOf(status), ElementsAre("no map -> odom, and poses are those of the camera: "
                                              "/tf_static does not connect base_link with camera"));
  status = kGood;
  status.is_metric = false;
  EXPECT_THAT(ProblemsOf(status), ElementsAre(HasSubstr("the unit is not the metre")));
  status = kGood;
  status.odom_from_base = Known::kNot;
  EXPECT_THAT(ProblemsOf(status), ElementsAre(HasSubstr("nobody publishes odom -> base_link")));
  status.odom_from_base = Known::kAtOtherTimes;
  EXPECT_THAT(ProblemsOf(status), ElementsAre(HasSubstr("other clock?")));
  status.wants_camera_tf = true;
  EXPECT_THAT(ProblemsOf(status), IsEmpty());
  status.camera_has_parent = true;
  EXPECT_THAT(ProblemsOf(status), ElementsAre(HasSubstr("camera has a parent already")));
}

}  // namespace
}  // namespace oaslam
