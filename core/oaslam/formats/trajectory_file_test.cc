#include "oaslam/trajectory_file.h"

#include <cmath>
#include <filesystem>

#include "expect_input_error.h"
#include "folder_test.h"

namespace oaslam {
namespace {

struct TrajectoryFile : FolderTest {};

TEST_F(TrajectoryFile, ReadsTumSortedByTime) {
  const auto poses = LoadTrajectory(folder.Write(
      "t.txt", "# comment\r\n2.5 1 2 3 0 0 0 1\r\n\n1.25 4 5 6 0 0 0.7071 0.7071 extra\n"));
  ASSERT_THAT(poses, SizeIs(2));
  EXPECT_EQ(poses[0].timestamp, 1.25);
  EXPECT_EQ(poses[1].world_from_cam.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(poses[0].world_from_cam.rotation.norm(), 1, 1e-15);
}

TEST_F(TrajectoryFile, RoundTripIsByteEqual) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 5; ++i)
    poses.push_back(
        {1311868164.363181 + i, Rigid3(Eigen::Quaterniond(-1, 0.1 * i, -0.2, 0.3).normalized(),
                                       Eigen::Vector3d(i, -1e-12, 0.5))});
  SaveTrajectory(folder / "a.txt", poses);
  const auto loaded = LoadTrajectory(folder / "a.txt");
  SaveTrajectory(folder / "b.txt", loaded);
  EXPECT_EQ(folder.Read("a.txt"), folder.Read("b.txt"));
  EXPECT_THAT(folder.Read("a.txt"),
              AllOf(StartsWith("1311868164.363181 0.000000000 0.000000000 0.500000000"),
                    Not(HasSubstr("-0.000000000"))));
  EXPECT_LT(loaded[3].world_from_cam.rotation.angularDistance(poses[3].world_from_cam.rotation),
            1e-8);
}

TEST_F(TrajectoryFile, BadLinesAreNamed) {
  const auto error = [&](const std::string& text) {
    return InputErrorOf([&] { LoadTrajectory(folder.Write("t.txt", text)); });
  };
  EXPECT_THAT(error("#\n1 2 3\n"), HasSubstrs("t.txt:2", "3 columns"));
  EXPECT_THAT(error("1 2 nan 4 0 0 0 1\n"), HasSubstrs("t.txt:1", "\"nan\""));
  EXPECT_THAT(error("1 2 3 4 0 0 0 0\n"), HasSubstr("quaternion of length 0"));
}

TEST_F(TrajectoryFile, EurocGroundTruth) {
  const auto poses = LoadTrajectory(folder.Write(
      "data.csv",
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1]\r\n"
      "1403636580838555648,4.68,-1.78,0.78,0.8,0.6,0,0,-0.02\r\n"
      "1403636580843555328,4.69,-1.78,0.78,0.8,0.6,0,0,-0.03\r\n"));
  ASSERT_THAT(poses, SizeIs(2));
  EXPECT_NEAR(poses[0].timestamp, 1403636580.838555648, 1e-6);
  EXPECT_EQ(poses[0].world_from_cam.translation, Eigen::Vector3d(4.68, -1.78, 0.78));
  EXPECT_NEAR(poses[0].world_from_cam.rotation.w(), 0.8, 1e-12);
  EXPECT_NEAR(poses[0].world_from_cam.rotation.x(), 0.6, 1e-12);
  // Without a header nanoseconds tell; a header with another order does, too.
  const auto bare =
      LoadTrajectory(folder.Write("b.csv", "1403636580838555648,1,2,3,0.8,0.6,0,0\n"));
  EXPECT_NEAR(bare[0].world_from_cam.rotation.x(), 0.6, 1e-12);
  const auto tum = LoadTrajectory(
      folder.Write("c.csv", "timestamp,tx,ty,tz,qx,qy,qz,qw\n1.5,1,2,3,0.6,0,0,0.8\n"));
  EXPECT_EQ(tum[0].timestamp, 1.5);
  EXPECT_NEAR(tum[0].world_from_cam.rotation.x(), 0.6, 1e-12);
  EXPECT_INPUT_ERROR(LoadTrajectory(folder.Write("d.csv", "1.5,1,2,3,0.6,0,0,0.8\n")),
                     HasSubstrs("d.csv", "order of its quaternions"));
}

TEST_F(TrajectoryFile, AHeaderTellsTheColumns) {
  // The first is Stray Scanner's.
  for (const char* text :
       {"timestamp, frame, x, y, z, qx, qy, qz, qw\n0.5, 000000, 1, 2, 3, 0.6, 0, 0, 0.8\n",
        "time,tx,ty,tz,qw,qx,qy,qz\n0.5,1,2,3,0.8,0.6,0,0\n"}) {
    const auto poses = LoadTrajectory(folder.Write("odometry.csv", text));
    ASSERT_THAT(poses, SizeIs(1)) << text;
    EXPECT_EQ(poses[0].world_from_cam.translation, Eigen::Vector3d(1, 2, 3)) << text;
    EXPECT_NEAR(poses[0].world_from_cam.rotation.x(), 0.6, 1e-12) << text;
  }
  EXPECT_INPUT_ERROR(LoadTrajectory(folder.Write("a.csv", "t,a,b\n0.5,1,2,3,0,0,0,1\n")),
                     HasSubstr("order of its quaternions"));
}

TEST_F(TrajectoryFile, TimesInNanosecondsInTumsLayout) {
  const auto poses =
      LoadTrajectory(folder.Write("t.txt", "1403636579763555584.000000 1 2 3 0 0 0 1\n"));
  EXPECT_NEAR(poses[0].timestamp, 1403636579.763555584, 1e-6);
  EXPECT_INPUT_ERROR(
      LoadTrajectory(folder.Write("t.txt", "0 1 2 3 0 0 0 1\n50000000 1 2 3 0 0 0 1\n")),
      HasSubstr("median step between its times is 5e+07"));
}

TEST_F(TrajectoryFile, Kitti) {
  const std::string path =
      folder.Write("00.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n0 0 1 7 0 1 0 8 -1 0 0 9\n");
  EXPECT_INPUT_ERROR(LoadTrajectory(path),
                     HasSubstrs("00.txt: has KITTI's twelve numbers", "times.txt"));
  folder.Write("times.txt", "0.000000e+00\n1.037e-01\n");
  const auto poses = LoadTrajectory(path);
  ASSERT_THAT(poses, SizeIs(2));
  EXPECT_EQ(poses[1].timestamp, 0.1037);
  EXPECT_EQ(poses[1].world_from_cam.translation, Eigen::Vector3d(7, 8, 9));
  EXPECT_LT((poses[1].world_from_cam.rotation * Eigen::Vector3d::UnitX() + Eigen::Vector3d::UnitZ())
                .norm(),
            1e-12);
  folder.Write("times.txt", "0\n");
  EXPECT_INPUT_ERROR(LoadTrajectory(path), HasSubstr("1 times, but"));
  for (const char* text : {"1 2 3 4 5 6 7 8 9 10 11 12\n", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"})
    EXPECT_INPUT_ERROR(LoadTrajectory(folder.Write("x.txt", text)), HasSubstr("x.txt"));
}

TEST_F(TrajectoryFile, NothingIsWrittenThatCannotBeRead) {
  Rigid3 broken;
  broken.translation.y() = INFINITY;
  for (const StampedPose& pose : {StampedPose{std::nan(""), {}}, StampedPose{1, broken}})
    EXPECT_INPUT_ERROR(SaveTrajectory(folder / "t.txt", {{0, {}}, pose}),
                       HasSubstrs("t.txt: pose 1", "not finite"));
  EXPECT_FALSE(std::filesystem::exists(folder / "t.txt"));
}

TEST_F(TrajectoryFile, ScoredPoses) {
  SaveScoredPoses(folder / "c.txt", {{{1.5, {}}, 34.25}, {{1.5, {}}, 2}});
  const auto poses = LoadScoredPoses(folder / "c.txt");
  ASSERT_THAT(poses, SizeIs(2));
  EXPECT_EQ(poses[0].score, 34.25);
  EXPECT_INPUT_ERROR(LoadScoredPoses(folder.Write("d.txt", "1 0 0 0 0 0 0 1\n")),
                     HasSubstr("expected 9"));
}

}  // namespace
}  // namespace oaslam
