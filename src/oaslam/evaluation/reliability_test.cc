#include "oaslam/evaluation/reliability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temp_folder.h"

namespace oaslam {
namespace {

using testing::SizeIs;

TEST(Reliability, TakesTheFirstHypothesisOfEachFrame) {
  const auto pose = [](double t, double x) {
    return StampedPose{t, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0))};
  };
  const std::vector<StampedPose> truth = {pose(0, 0), pose(1, 1), pose(2, 2)};
  const std::vector<ScoredPose> hypotheses = {
      {pose(0, 0.5), 9}, {pose(0, 0), 3}, {pose(2, 2), 5}, {pose(2, 7), 4}};
  const auto errors =
      CompareHypotheses(truth, hypotheses, {{0, 0.3}, {1, 0}, {2, 0.8}}, Alignment{});
  ASSERT_THAT(errors, SizeIs(2));
  EXPECT_DOUBLE_EQ(errors[0].confidence, 0.3);
  EXPECT_DOUBLE_EQ(errors[0].error.position, 0.5);
  EXPECT_DOUBLE_EQ(errors[1].confidence, 0.8);
  EXPECT_DOUBLE_EQ(errors[1].error.position, 0);
}

TEST(Reliability, IsSaved) {
  const TempFolder folder;
  SaveHypothesisErrors(folder / "h.csv", std::vector{HypothesisError{0.25, {1.5, 0.125, 3}}});
  EXPECT_EQ(folder.Read("h.csv"),
            "timestamp,confidence,position_error_m,rotation_error_deg\n"
            "1.500000,0.2500,0.125,3.0000\n");
}

}  // namespace
}  // namespace oaslam
