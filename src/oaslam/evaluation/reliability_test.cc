#include "oaslam/evaluation/reliability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "expect_input_error.h"
#include "oaslam/evaluation/plots.h"
#include "oaslam/evaluation/state_plot.h"
#include "oaslam/formats/text.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

HypothesisError Hypothesis(double confidence, double position, double rotation_deg = 0) {
  return {confidence, {0, position, rotation_deg}};
}

TEST(Reliability, ComparesConfidenceWithTheShareThatIsRight) {
  const std::vector<HypothesisError> hypotheses = {
      Hypothesis(0.95, 0.01), Hypothesis(0.95, 0.49), Hypothesis(0.91, 0.1, 31),
      Hypothesis(1, 0.1),     Hypothesis(0.2, 3),     Hypothesis(0.25, 0.02)};
  const Reliability reliability = SummarizeReliability(hypotheses);
  EXPECT_EQ(reliability.count, 6u);
  EXPECT_EQ(reliability.bins[9].count, 4u);
  EXPECT_DOUBLE_EQ(reliability.bins[9].share_right, 0.75);  // turned by 31 degrees is wrong
  EXPECT_DOUBLE_EQ(reliability.bins[9].mean_confidence, (0.95 + 0.95 + 0.91 + 1) / 4);
  EXPECT_DOUBLE_EQ(reliability.bins[2].share_right, 0.5);
  EXPECT_EQ(reliability.bins[5].count, 0u);
  EXPECT_NEAR(reliability.calibration_error, (4 * (3.81 / 4 - 0.75) + 2 * (0.5 - 0.225)) / 6,
              1e-12);
  EXPECT_NEAR(reliability.brier, (2 * 0.05 * 0.05 + 0.91 * 0.91 + 0.2 * 0.2 + 0.75 * 0.75) / 6,
              1e-12);
  EXPECT_EQ(SummarizeReliability({}).count, 0u);
}

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

TEST(Reliability, IsSavedLoadedAndDrawn) {
  const TempFolder folder;
  const std::string path = folder / "hypotheses.csv";
  SaveHypothesisErrors(path, std::vector{Hypothesis(0.25, 0.125, 3), Hypothesis(0.75, 2)});
  const auto loaded = LoadHypothesisErrors(path);
  ASSERT_THAT(loaded, SizeIs(2));
  EXPECT_DOUBLE_EQ(loaded[0].confidence, 0.25);
  EXPECT_DOUBLE_EQ(loaded[0].error.position, 0.125);
  EXPECT_DOUBLE_EQ(loaded[0].error.rotation_deg, 3);
  SaveReliabilityPlot(folder / "plot.svg", {{"both", SummarizeReliability(loaded)}}, "title");
  EXPECT_THAT(ReadTextFile(folder / "plot.svg"), HasSubstr("both (2 frames)"));
  WriteTextFile(path, "timestamp,confidence,position_error_m,rotation_error_deg\n0,1.5,0,0\n");
  EXPECT_THAT(InputErrorOf([&] { LoadHypothesisErrors(path); }),
              HasSubstr("confidence 1.5, allowed: 0 to 1"));
  WriteTextFile(path, "timestamp,confidence\n0,0.5\n");
  EXPECT_THAT(InputErrorOf([&] { LoadHypothesisErrors(path); }),
              HasSubstr("\"position_error_m\" is missing"));
}

TEST(States, AreLoadedAndDrawn) {
  const TempFolder folder;
  const std::string path = folder / "frames.csv";
  WriteTextFile(path,
                "frame,timestamp,state,filled\n0,0.0,initializing,1\n1,0.1,tracking,0\n2,0.2,lost,"
                "0\n3,0.3,objects,0\n");
  const StateRow row = LoadStates(path);
  EXPECT_THAT(row.states, ElementsAre("filled", "tracking", "lost", "objects"));
  SaveStatePlot(folder / "plot.svg", {row, row}, "title");
  EXPECT_THAT(ReadTextFile(folder / "plot.svg"), HasSubstr("75 % of 4 frames have a pose"));
  WriteTextFile(path, "frame,timestamp,state,filled\n0,0.0,asleep,0\n");
  EXPECT_THAT(InputErrorOf([&] { LoadStates(path); }),
              HasSubstr("frames.csv:2: state \"asleep\" is unknown"));
  WriteTextFile(path, "frame,timestamp,state,filled\n");
  EXPECT_THAT(InputErrorOf([&] { LoadStates(path); }), HasSubstr("no frames"));
}

}  // namespace
}  // namespace oaslam
