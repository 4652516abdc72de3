#include "oaslam/formats/imu_pose.h"

#include "expect_input_error.h"
#include "folder_test.h"

namespace oaslam {
namespace {

// The camera looks along the body's x axis, its x axis is against the body's y axis.
const std::string kBodyFromCam = "[0, 0, 1, 0.1,  -1, 0, 0, 0.2,  0, -1, 0, 0.3,  0, 0, 0, 1]";
const std::string kCamFromBody =
    "\n  - [0, -1, 0, 0.2]\n  - [0, 0, -1, 0.3]\n  - [1, 0, 0, -0.1]\n  - [0, 0, 0, 1]\n";

struct ImuPose : FolderTest {
  std::string ProblemOf(const std::string& text) {
    return InputErrorOf([&] { LoadCameraFromImu(folder.Write("cam.yaml", text)); });
  }
};

TEST_F(ImuPose, EachKeyTellsHowTheCameraLies) {
  for (const std::string& text :
       {"T_BS:\n  cols: 4\n  rows: 4\n  data: " + kBodyFromCam,
        "cam0:\n  T_cam_imu:" + kCamFromBody, "T_cam_imu:" + kCamFromBody,
        "cam0:\n  T_imu_cam: " + kBodyFromCam,
        "%YAML:1.0\n---\nTbc: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  data: " +
            kBodyFromCam,
        "IMU.T_b_c1: " + kBodyFromCam, "body_T_cam0: " + kBodyFromCam,
        "T_BS: " + kBodyFromCam + "\nT_cam_imu:" + kCamFromBody}) {
    const auto motion = LoadCameraFromImu(folder.Write("cam.yaml", text + "\n"));
    ASSERT_TRUE(motion) << text;
    EXPECT_TRUE((motion->rotation * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitZ()));
    EXPECT_TRUE((motion->rotation * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitX()));
    EXPECT_TRUE(motion->translation.isApprox(Eigen::Vector3d(0.2, 0.3, -0.1))) << text;
  }
}

TEST_F(ImuPose, ManyFilesDoNotTell) {
  EXPECT_FALSE(LoadCameraFromImu("fov:60"));
  EXPECT_FALSE(
      LoadCameraFromImu(folder.Write("cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n")));
  EXPECT_FALSE(LoadCameraFromImu(folder.Write("cam.yaml", "cam0:\n  rostopic: T_cam_imu\n")));
}

TEST_F(ImuPose, ErrorsNameTheKeyAndTheBound) {
  EXPECT_THAT(ProblemOf("T_BS: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"),
              HasSubstrs("cam.yaml: T_BS", "9 values, expected 16"));
  EXPECT_THAT(ProblemOf("T_BS: [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"),
              HasSubstrs("cam.yaml: T_BS", "no rotation"));
  EXPECT_THAT(ProblemOf("cam0:\n  T_imu_cam: [1, 0, 0, 0, 0, 1, 0, -64, 0, 0, 1, 0, 0, 0, 0, 1]\n"),
              HasSubstrs("cam0.T_imu_cam", "64 m long", "0 to 10 m", "millimetres"));
  // The same matrix for both directions.
  EXPECT_THAT(ProblemOf("T_BS: " + kBodyFromCam + "\nT_cam_imu: " + kBodyFromCam + "\n"),
              HasSubstrs("T_BS and T_cam_imu contradict each other"));
}

}  // namespace
}  // namespace oaslam
