#include <cmath>
#include <numbers>

#include "expect_input_error.h"
#include "oaslam/evaluation/object_metrics.h"
#include "oaslam/evaluation/plots.h"
#include "oaslam/evaluation/relocalization_metrics.h"
#include "oaslam/evaluation/trajectory_metrics.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

std::vector<StampedPose> Spiral(int count) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < count; ++i) {
    const double a = 0.05 * i;
    poses.push_back(
        {i / 30.0, Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(a, Eigen::Vector3d::UnitY())),
                          Eigen::Vector3d(2 * std::cos(a), 0.01 * i, 2 * std::sin(a)))});
  }
  return poses;
}

const Alignment kSomewhere{0.4, Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized(),
                           Eigen::Vector3d(3, -2, 1)};

TEST(Associate, TakesTheNearestWithinTheBound) {
  const std::vector<StampedPose> reference = {{1.00, {}}, {1.03, {}}, {1.06, {}}, {5, {}}};
  const std::vector<StampedPose> query = {{0.97, {}},  {0.985, {}}, {1.02, {}},
                                          {1.079, {}}, {3, {}},     {5.01, {}}};
  const auto pairs = Associate(reference, query);
  ASSERT_THAT(pairs, SizeIs(4));
  EXPECT_EQ(pairs[0].reference, 0u);
  EXPECT_EQ(pairs[0].query, 1u);
  EXPECT_EQ(pairs[1].reference, 1u);
  EXPECT_EQ(pairs[2].reference, 2u);
  EXPECT_EQ(pairs[3].query, 5u);
  EXPECT_TRUE(Associate({}, query).empty());
}

TEST(TrajectoryMetrics, ASimilarityIsNoError) {
  const auto truth = Spiral(100);
  const auto report = EvaluateTrajectory(truth, Aligned(truth, kSomewhere), AlignMode::kSim3);
  ASSERT_TRUE(report.success);
  EXPECT_EQ(report.position.count, 100u);
  EXPECT_LT(report.position.max, 1e-9);
  EXPECT_LT(report.rotation_deg.max, 1e-5);
  EXPECT_NEAR(report.reference_from_estimate.scale, 2.5, 1e-9);
  const auto rigid = EvaluateTrajectory(truth, Aligned(truth, kSomewhere), AlignMode::kSe3);
  EXPECT_GT(rigid.position.rmse, 0.5);
  EXPECT_LT(rigid.rotation_deg.max, 1e-5);
  EXPECT_GT(EvaluateTrajectory(truth, Aligned(truth, kSomewhere), AlignMode::kNone).position.rmse,
            2);
  const auto relative = EvaluateRelative(truth, Aligned(truth, kSomewhere), 2.5, 1);
  EXPECT_EQ(relative.translation.count, 70u);
  EXPECT_LT(relative.translation.max, 1e-9);
}

TEST(TrajectoryMetrics, KnownErrors) {
  const auto truth = Spiral(60);
  auto estimate = truth;
  for (size_t i = 0; i < estimate.size(); ++i)
    estimate[i].world_from_cam.translation.x() += i % 2 == 0 ? 0.03 : -0.01;
  const auto report = EvaluateTrajectory(truth, estimate, AlignMode::kNone);
  EXPECT_NEAR(report.position.rmse, std::sqrt((0.03 * 0.03 + 0.01 * 0.01) / 2), 1e-12);
  EXPECT_NEAR(report.position.mean, 0.02, 1e-12);
  EXPECT_NEAR(report.position.median, 0.02, 1e-12);
  EXPECT_NEAR(report.position.max, 0.03, 1e-12);
  EXPECT_NEAR(EvaluateRelative(truth, estimate, 1, 0).translation.rmse, 0.04, 1e-12);
}

TEST(TrajectoryMetrics, ComparesErrorsWithTheirSigmas) {
  const auto truth = Spiral(60);
  auto estimate = truth;
  std::vector<std::pair<double, double>> sigmas;
  for (size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].world_from_cam.translation.x() += i % 4 == 0 ? 0.08 : 0.02;
    if (i < 40) sigmas.emplace_back(estimate[i].timestamp, i == 0 ? 0 : 0.02);
  }
  const auto report = EvaluateTrajectory(truth, estimate, AlignMode::kNone);
  const ConsistencyReport consistency = EvaluateConsistency(report, sigmas);
  EXPECT_EQ(consistency.count, 39u);  // a sigma of 0 says nothing
  EXPECT_NEAR(consistency.median, 1, 1e-9);
  EXPECT_NEAR(consistency.share_beyond, 9 / 39.0, 1e-9);
  EXPECT_EQ(EvaluateConsistency(report, {}).count, 0u);
}

TEST(TrajectoryMetrics, SaysWhyNot) {
  const auto truth = Spiral(60);
  auto late = truth;
  for (StampedPose& pose : late) pose.timestamp += 100;
  EXPECT_THAT(EvaluateTrajectory(truth, late, AlignMode::kSim3).why_not,
              HasSubstrs("no pose within", "its times are 100.00 to "));
  EXPECT_THAT(EvaluateTrajectory(truth, {truth[0], truth[1]}, AlignMode::kSim3).why_not,
              HasSubstr("2 of 2 poses"));
  auto still = truth;
  for (StampedPose& pose : still) pose.world_from_cam = Rigid3();
  EXPECT_FALSE(EvaluateTrajectory(truth, still, AlignMode::kSim3).success);
}

TEST(RelocalizationMetrics, CountsLikeTheDefinition) {
  const auto truth = Spiral(10);
  auto poses = truth;
  poses.resize(8);  // two frames without an answer
  poses[1].world_from_cam.translation.y() += 0.07;
  poses[2].world_from_cam.translation.y() += 0.7;
  poses[3].world_from_cam.rotation =
      poses[3].world_from_cam.rotation *
      Eigen::AngleAxisd(20 * std::numbers::pi / 180, Eigen::Vector3d::UnitX());
  poses[4].world_from_cam.rotation =
      poses[4].world_from_cam.rotation *
      Eigen::AngleAxisd(40 * std::numbers::pi / 180, Eigen::Vector3d::UnitX());
  std::vector<double> times;
  for (const StampedPose& pose : truth) times.push_back(pose.timestamp);
  times.push_back(77);  // without ground truth
  const auto errors = CompareRelocalization(truth, poses, times, Alignment());
  EXPECT_EQ(errors.frames, 10u);
  const auto figures = Summarize(errors);
  EXPECT_DOUBLE_EQ(figures.recall[0], 0.4);
  EXPECT_DOUBLE_EQ(figures.recall[1], 0.5);
  EXPECT_DOUBLE_EQ(figures.recall[5], 0.6);
  EXPECT_DOUBLE_EQ(figures.precision[1], 5.0 / 8);
  EXPECT_DOUBLE_EQ(figures.accepted, 0.8);
  EXPECT_DOUBLE_EQ(figures.false_share, 0.2);
}

TEST(RelocalizationMetrics, FilesAndPlot) {
  const TempFolder folder;
  const RelocalizationErrors errors{"", 4, {{0, 0.03, 0.9}, {2, 0.2, 1}, {3, 0.04, 50}}};
  EXPECT_DOUBLE_EQ(RecallAt(errors, 0.1), 0.25);
  EXPECT_THAT(LoadFrameTimes(folder.Write("frames.csv",
                                          "frame,timestamp,status\n0,1.5,failed\n1,1.25,points\n")),
              ElementsAre(1.25, 1.5));
  EXPECT_THAT(LoadFrameTimes(folder.Write("rgb.txt", "# a\n1.5 rgb/1.png\n")), ElementsAre(1.5));
  EXPECT_INPUT_ERROR(LoadFrameTimes(folder.Write("x.csv", "frame,time\n")),
                     HasSubstr("\"timestamp\" is missing"));
  SaveRecallPlot(folder / "r.svg", {errors}, "Recall");
  EXPECT_THAT(folder.Read("r.svg"), AllOf(HasSubstr("4 frames"), Not(HasSubstr("nan"))));
  SaveTrajectoryPlot(folder / "t.svg", Spiral(50), Spiral(40), "Spiral");
  EXPECT_THAT(folder.Read("t.svg"), AllOf(HasSubstr("ground truth"), Not(HasSubstr("nan"))));
}

TEST(ObjectMetrics, OneToOneByClassAndCentre) {
  const TempFolder folder;
  const auto truth = LoadTrueObjects(folder.Write(
      "gt.json",
      R"({"objects": [{"category_id": 41, "category": "cup", "ellipsoid": {"center": [0, 0, 1], "rotation": [[1,0,0],[0,1,0],[0,0,1]], "semi_axes": [0.1, 0.1, 0.2]}},
                                 {"category_id": 62, "category": "tv", "ellipsoid": {"center": [1, 0, 1], "rotation": [[1,0,0],[0,1,0],[0,0,1]], "semi_axes": [0.5, 0.1, 0.4]}}]})"));
  const auto mapped = LoadObjects(folder.Write("o.json", R"([
    {"id": 1, "category_id": 41, "category": "cup", "center": [0, 0, 0.55], "half_axes": [0.05, 0.05, 0.1], "rotation": [0, 0, 0, 1]},
    {"id": 2, "category_id": 41, "category": "cup", "center": [0, 0, 0.5], "half_axes": [0.05, 0.05, 0.1], "rotation": [0, 0, 0, 1]},
    {"id": 3, "category_id": 41, "category": "cup", "center": [0.5, 0, 0.5], "half_axes": [0.05, 0.05, 0.1], "rotation": [0, 0, 0, 1]}])"));
  const auto report =
      EvaluateObjects(mapped, truth, {2, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()});
  ASSERT_THAT(report.matches, SizeIs(1));
  EXPECT_EQ(report.matches[0].mapped, 0u);
  EXPECT_NEAR(report.matches[0].centre, 0.5, 1e-12);
  EXPECT_NEAR(report.matches[0].log_size, 0, 1e-12);
  EXPECT_DOUBLE_EQ(report.recall, 0.5);
  EXPECT_DOUBLE_EQ(report.precision, 1.0 / 3);
  EXPECT_INPUT_ERROR(LoadObjects(folder.Write("bad.json", R"([{"id": 1, "category_id": 4}])")),
                     HasSubstr("object 0"));
  EXPECT_INPUT_ERROR(LoadTrueObjects(folder.Write("bad.json", "{}")), HasSubstr("objects"));
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

TEST(Reliability, IsSaved) {
  const TempFolder folder;
  SaveHypothesisErrors(folder / "h.csv", std::vector{HypothesisError{0.25, {1.5, 0.125, 3}}});
  EXPECT_EQ(folder.Read("h.csv"),
            "timestamp,confidence,position_error_m,rotation_error_deg\n"
            "1.500000,0.2500,0.125,3.0000\n");
}

}  // namespace
}  // namespace oaslam
