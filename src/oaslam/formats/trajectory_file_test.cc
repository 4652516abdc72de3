#include "oaslam/trajectory_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "expect_input_error.h"
#include "oaslam/class_names.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;

TEST(TrajectoryFile, ReadsTumSortedByTime) {
  const TempFolder folder;
  const auto poses = LoadTrajectory(folder.Write(
      "t.txt", "# comment\r\n2.5 1 2 3 0 0 0 1\r\n\n1.25 4 5 6 0 0 0.7071 0.7071 extra\n"));
  ASSERT_THAT(poses, SizeIs(2));
  EXPECT_EQ(poses[0].timestamp, 1.25);
  EXPECT_EQ(poses[1].world_from_cam.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(poses[0].world_from_cam.rotation.norm(), 1, 1e-15);
}

TEST(TrajectoryFile, RoundTripIsByteEqual) {
  const TempFolder folder;
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
              AllOf(testing::StartsWith("1311868164.363181 0.000000000 0.000000000 0.500000000"),
                    testing::Not(HasSubstr("-0.000000000"))));
  EXPECT_LT(loaded[3].world_from_cam.rotation.angularDistance(poses[3].world_from_cam.rotation),
            1e-8);
}

TEST(TrajectoryFile, BadLinesAreNamed) {
  const TempFolder folder;
  const auto error = [&](const std::string& text) {
    return InputErrorOf([&] { LoadTrajectory(folder.Write("t.txt", text)); });
  };
  EXPECT_THAT(error("#\n1 2 3\n"), AllOf(HasSubstr("t.txt:2"), HasSubstr("3 columns")));
  EXPECT_THAT(error("1 2 nan 4 0 0 0 1\n"), AllOf(HasSubstr("t.txt:1"), HasSubstr("\"nan\"")));
  EXPECT_THAT(error("1 2 3 4 0 0 0 0\n"), HasSubstr("quaternion of length 0"));
}

TEST(TrajectoryFile, NothingIsWrittenThatCannotBeRead) {
  const TempFolder folder;
  Rigid3 broken;
  broken.translation.y() = INFINITY;
  for (const StampedPose& pose : {StampedPose{std::nan(""), {}}, StampedPose{1, broken}})
    EXPECT_THAT(InputErrorOf([&] {
                  SaveTrajectory(folder / "t.txt", {{0, {}}, pose});
                }),
                AllOf(HasSubstr("t.txt: pose 1"), HasSubstr("not finite")));
  EXPECT_FALSE(std::filesystem::exists(folder / "t.txt"));
}

TEST(TrajectoryFile, ScoredPoses) {
  const TempFolder folder;
  SaveScoredPoses(folder / "c.txt", {{{1.5, {}}, 34.25}, {{1.5, {}}, 2}});
  const auto poses = LoadScoredPoses(folder / "c.txt");
  ASSERT_THAT(poses, SizeIs(2));
  EXPECT_EQ(poses[0].score, 34.25);
  EXPECT_THAT(InputErrorOf([&] { LoadScoredPoses(folder.Write("d.txt", "1 0 0 0 0 0 0 1\n")); }),
              HasSubstr("expected 9"));
}

}  // namespace
}  // namespace oaslam
