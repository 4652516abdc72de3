#include "oaslam/formats/imu_file.h"

#include <fmt/format.h>

#include "expect_input_error.h"
#include "folder_test.h"

namespace oaslam {
namespace {

const Eigen::Quaterniond kSame = Eigen::Quaterniond::Identity();

struct ImuFile : FolderTest {};

TEST_F(ImuFile, ReadsTheGyroscopeOfEuroc) {
  const std::string path = folder.Write(
      "data.csv",
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m "
      "s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\r\n"
      "1403636579758555392,-0.1,0.2,0.3,8.1,-0.3,-3.2\r\n1403636579763555584, 1e-1,0,-2\r\n");
  const auto samples = LoadImu(path, kSame);
  ASSERT_THAT(samples, SizeIs(2));
  EXPECT_NEAR(samples[0].timestamp, 1403636579.758555392, 1e-6);
  EXPECT_EQ(samples[0].in_cam, Eigen::Vector3d(-0.1, 0.2, 0.3));
  EXPECT_EQ(samples[1].in_cam, Eigen::Vector3d(0.1, 0, -2));
  // The camera's x axis is the gyroscope's y axis, its y axis points against x.
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitZ()));
  EXPECT_TRUE(LoadImu(path, turned)[0].in_cam.isApprox(Eigen::Vector3d(0.2, 0.1, 0.3)));
}

TEST_F(ImuFile, ErrorsNameTheLineAndTheBound) {
  const auto problem = [&](const std::string& text) {
    return InputErrorOf([&] { LoadImu(folder.Write("imu.csv", text), kSame); });
  };
  EXPECT_THAT(problem("# nothing\n"), HasSubstrs("imu.csv", "EuRoC"));
  EXPECT_THAT(problem("10,0,0,0\n20,0,x,0\n"), HasSubstr("imu.csv:2: column 3"));
  EXPECT_THAT(problem("10,0,0\n"), HasSubstr("imu.csv:1: column 4"));
  EXPECT_THAT(problem("1000000000,0,0,0\n1000000000,0,0,0\n"),
              HasSubstrs("imu.csv:2", "not after the one before, 1.000000"));
  EXPECT_THAT(problem("10,0,180,0\n"), HasSubstrs("imu.csv:1", "180 rad/s", "0 to 100"));
  EXPECT_INPUT_ERROR(LoadImu(folder / "none.csv", kSame), HasSubstr("none.csv"));
}

TEST_F(ImuFile, TimeStampsInAnotherUnitAreRefused) {
  // Samples 5 ms apart after a comment, with one gap of a second.
  const auto load = [&](double unit_s) {
    std::string text = "# timestamp\n";
    for (const double t : {1.0, 1.005, 1.010, 2.010, 2.015, 2.020})
      text += fmt::format("{},0,0,0\n", t / unit_s);
    return LoadImu(folder.Write("imu.csv", text), kSame);
  };
  EXPECT_THAT(load(1e-9), SizeIs(6));
  for (const double unit_s : {1.0, 1e-3, 1e-6})
    EXPECT_INPUT_ERROR(load(unit_s),
                       HasSubstrs("imu.csv:2: ", "median spacing 5e-", "0.0001 to 0.1 s", "in ns"));
  EXPECT_INPUT_ERROR(
      LoadImu(folder.Write("slow.csv", "1000000000,0,0,0\n2000000000,0,0,0\n"), kSame),
      HasSubstrs("slow.csv:1: ", "median spacing 1 s"));
}

TEST_F(ImuFile, TheCalibrationTellsHowTheCameraLies) {
  // The camera looks along the body's x axis, its x axis is against the body's y axis.
  const std::string body_from_cam = "[0, 0, 1, 0.1,  -1, 0, 0, 0.2,  0, -1, 0, 0.3,  0, 0, 0, 1]";
  const auto looks_along_x = [](const std::optional<Eigen::Quaterniond>& camera_from_imu) {
    return camera_from_imu &&
           (*camera_from_imu * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitZ()) &&
           (*camera_from_imu * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitX());
  };
  EXPECT_TRUE(looks_along_x(LoadCameraFromImu(folder.Write(
      "sensor.yaml", "T_BS:\n  cols: 4\n  rows: 4\n  data: " + body_from_cam + "\n"))));
  EXPECT_TRUE(looks_along_x(LoadCameraFromImu(
      folder.Write("camchain.yaml",
                   "cam0:\n  T_cam_imu:\n  - [0, -1, 0, 0]\n  - [0, 0, -1, 0]\n  - [1, 0, 0, 0]\n"
                   "  - [0, 0, 0, 1]\n"))));
  EXPECT_FALSE(LoadCameraFromImu("fov:60"));
  EXPECT_FALSE(
      LoadCameraFromImu(folder.Write("cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n")));
  EXPECT_INPUT_ERROR(
      LoadCameraFromImu(folder.Write("short.yaml", "T_BS: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n")),
      HasSubstrs("short.yaml: T_BS", "9 values, expected 16"));
  EXPECT_INPUT_ERROR(
      LoadCameraFromImu(
          folder.Write("mirror.yaml", "T_BS: [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n")),
      HasSubstrs("mirror.yaml: T_BS", "no rotation"));
}

}  // namespace
}  // namespace oaslam
