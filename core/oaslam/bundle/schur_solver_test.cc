#include "oaslam/bundle/schur_solver.h"

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include "oaslam/bundle/reprojection_cost.h"
#include "oaslam/geometry/camera_model.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

struct Problem {
  synthetic::World world;
  CamerasAndPoints truth, state;
  std::vector<PointMeasurement> measurements;
};

// The first `free` of eight cameras and all points are disturbed from the true solution.
Problem MakeProblem(int free, double noise_px, double wrong_share = 0) {
  Problem p;
  p.world = synthetic::MakeWorld({.points = 150, .cameras = 8});
  Rng rng(5);
  p.truth.poses = p.world.cam_from_world;
  p.truth.points = p.world.points;
  p.truth.cameras.assign(p.truth.poses.size(), &p.world.camera);
  for (int i = 0; i < static_cast<int>(p.truth.points.size()); ++i) {
    for (int k = 0; k < static_cast<int>(p.truth.poses.size()); ++k) {
      const Eigen::Vector3d x = p.truth.poses[k] * p.truth.points[i];
      if (x.z() < 0.1 || rng.Uniform(0, 1) < 0.3) continue;
      Eigen::Vector2d px = ProjectIdeal(p.world.camera, x) +
                           Eigen::Vector2d(rng.Gaussian(noise_px), rng.Gaussian(noise_px));
      if (rng.Uniform(0, 1) < wrong_share)
        px += Eigen::Vector2d(rng.Uniform(-80, 80), rng.Uniform(-80, 80));
      p.measurements.push_back({k, i, px, 1});
    }
  }
  p.state = p.truth;
  for (int k = 0; k < free; ++k)
    p.state.poses[k] = synthetic::Disturb(p.state.poses[k], 0.03, 0.01, rng);
  for (Eigen::Vector3d& x : p.state.points)
    x += Eigen::Vector3d(rng.Gaussian(0.03), rng.Gaussian(0.03), rng.Gaussian(0.03));
  return p;
}

double PoseError(const Problem& p) { return CenterErrorsOf(p.state.poses, p.truth.poses).worst; }

double SumOfSquares(const Problem& p) {
  double sum = 0;
  for (const PointMeasurement& s : p.measurements)
    sum += (ProjectIdeal(p.world.camera, p.state.poses[s.pose] * p.state.points[s.point]) - s.px)
               .squaredNorm();
  return sum;
}

TEST(SchurSolver, FindsTheTruthOfExactSights) {
  Problem p = MakeProblem(6, 0);
  const MinimizationReport report =
      MinimizeReprojection(p.measurements, 6, {.max_iterations = 30, .tolerance = 1e-9}, p.state);
  EXPECT_TRUE(report.success);
  EXPECT_LT(SumOfSquares(p), 1e-6);
  EXPECT_LT(PoseError(p), 1e-5);
  for (size_t k = 6; k < 8; ++k)
    EXPECT_EQ(p.state.poses[k].translation, p.truth.poses[k].translation);
}

// Seven of the eight cameras and all points are free: the sights do not tell the unit.
TEST(SchurSolver, DepthsTellTheUnitAlsoWhereSomeAreOfAnotherSurface) {
  Problem p = MakeProblem(7, 0);
  size_t next = 0;
  for (PointMeasurement& s : p.measurements) {
    const double z = (p.truth.poses[s.pose] * p.truth.points[s.point]).z();
    s.depth = {next % 3 == 0 ? z : 0, 0.01};
    if (next++ % 60 == 0) s.depth.z += 1;
  }
  const Rigid3 held = p.truth.poses[7];
  for (int k = 0; k < 7; ++k) {  // the same sights in another unit
    const Eigen::Vector3d from_held = p.truth.poses[k].OriginInSource() - held.OriginInSource();
    p.state.poses[k] =
        Rigid3(p.truth.poses[k].rotation,
               p.truth.poses[k].rotation * -(held.OriginInSource() + 1.1 * from_held));
  }
  for (size_t i = 0; i < p.truth.points.size(); ++i)
    p.state.points[i] = held.OriginInSource() + 1.1 * (p.truth.points[i] - held.OriginInSource());
  Problem without = p;
  for (PointMeasurement& s : without.measurements) s.depth = {};
  const SchurOptions options{.max_iterations = 50, .tolerance = 1e-12};
  ASSERT_TRUE(MinimizeReprojection(p.measurements, 7, options, p.state).success);
  MinimizeReprojection(without.measurements, 7, options, without.state);
  EXPECT_LT(PoseError(p), 0.01);
  EXPECT_GT(PoseError(without), 0.05);
}

TEST(SchurSolver, EndsAtAMinimum) {
  Problem p = MakeProblem(6, 1);
  ASSERT_TRUE(
      MinimizeReprojection(p.measurements, 6, {.max_iterations = 50, .tolerance = 1e-12}, p.state)
          .success);
  const double best = SumOfSquares(p);
  Rng rng(9);
  for (int i = 0; i < 20; ++i) {
    Problem moved = p;
    for (int k = 0; k < 6; ++k)
      moved.state.poses[k] = synthetic::Disturb(moved.state.poses[k], 1e-4, 1e-5, rng);
    for (Eigen::Vector3d& x : moved.state.points)
      x += 1e-4 * Eigen::Vector3d(rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1));
    EXPECT_GT(SumOfSquares(moved), best);
  }
}

TEST(SchurSolver, TheKernelHoldsOutliersBack) {
  Problem plain = MakeProblem(6, 0.5, 0.05), robust = plain;
  MinimizeReprojection(plain.measurements, 6, {.max_iterations = 30, .tolerance = 1e-6},
                       plain.state);
  MinimizeReprojection(robust.measurements, 6,
                       {.max_iterations = 30, .tolerance = 1e-6, .huber_chi2 = 5.991},
                       robust.state);
  EXPECT_LT(PoseError(robust), 0.4 * PoseError(plain));
}

// Cameras alternate between two lenses and key points between levels, so that an exchange of either
// would be noticed.
void MakeUneven(Problem& p) {
  static const Camera kOther{
      .width = 640, .height = 480, .fx = 430, .fy = 455, .cx = 300, .cy = 251};
  Rng rng(17);
  for (size_t k = 1; k < p.truth.cameras.size(); k += 2)
    p.truth.cameras[k] = p.state.cameras[k] = &kOther;
  for (PointMeasurement& s : p.measurements) {
    const double sigma = std::pow(1.2, rng.Index(6));
    s.inverse_sigma = 1 / sigma;
    s.px = ProjectIdeal(*p.truth.cameras[s.pose], p.truth.poses[s.pose] * p.truth.points[s.point]) +
           Eigen::Vector2d(rng.Gaussian(sigma), rng.Gaussian(sigma));
    if (rng.Uniform(0, 1) < 0.05)
      s.px += Eigen::Vector2d(rng.Uniform(-60, 60), rng.Uniform(-60, 60));
  }
}

CamerasAndPoints SolvedByCeres(const Problem& p, int free, double huber_chi2) {
  std::vector<PoseBlock> poses;
  for (const Rigid3& pose : p.state.poses) poses.push_back(ToBlock(pose));
  std::vector<Eigen::Vector3d> points = p.state.points;
  ceres::Problem problem;
  for (PoseBlock& pose : poses) problem.AddParameterBlock(pose.data(), 7, new PoseManifold);
  for (const PointMeasurement& s : p.measurements)
    problem.AddResidualBlock(
        new ReprojectionCost(*p.state.cameras[s.pose], s.px, 1 / s.inverse_sigma),
        huber_chi2 > 0 ? new ceres::HuberLoss(std::sqrt(huber_chi2)) : nullptr,
        poses[s.pose].data(), points[s.point].data());
  for (size_t k = static_cast<size_t>(free); k < poses.size(); ++k)
    problem.SetParameterBlockConstant(poses[k].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 200;
  options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  EXPECT_TRUE(summary.IsSolutionUsable());
  CamerasAndPoints solved = p.state;
  for (size_t k = 0; k < poses.size(); ++k) solved.poses[k] = FromBlock(poses[k]);
  solved.points = points;
  return solved;
}

TEST(SchurSolver, EndsWhereCeresEnds) {
  for (const double huber_chi2 : {0.0, 5.991}) {
    Problem p = MakeProblem(6, 0);
    MakeUneven(p);
    const CamerasAndPoints expected = SolvedByCeres(p, 6, huber_chi2);
    ASSERT_TRUE(MinimizeReprojection(
                    p.measurements, 6,
                    {.max_iterations = 200, .tolerance = 1e-14, .huber_chi2 = huber_chi2}, p.state)
                    .success);
    for (size_t k = 0; k < p.state.poses.size(); ++k) {
      EXPECT_LT(CenterDistance(p.state.poses[k], expected.poses[k]), 1e-5)
          << huber_chi2 << " pose " << k;
      EXPECT_LT(p.state.poses[k].rotation.angularDistance(expected.poses[k].rotation), 1e-5)
          << huber_chi2 << " pose " << k;
    }
    for (size_t i = 0; i < p.state.points.size(); ++i)
      EXPECT_LT((p.state.points[i] - expected.points[i]).norm(), 1e-4)
          << huber_chi2 << " point " << i;
    // Far enough from the truth, so that the two do not agree merely because both are exact.
    EXPECT_GT(PoseError(p), 1e-3);
  }
}

TEST(SchurSolver, ACameraThatSeesNothingStaysAndDoesNoHarm) {
  Problem p = MakeProblem(6, 0);
  std::erase_if(p.measurements, [](const PointMeasurement& s) { return s.pose == 2; });
  const Rigid3 blind = p.state.poses[2];
  ASSERT_TRUE(
      MinimizeReprojection(p.measurements, 6, {.max_iterations = 30, .tolerance = 1e-9}, p.state)
          .success);
  EXPECT_LT((p.state.poses[2].translation - blind.translation).norm(), 1e-9);
  EXPECT_LT(CenterDistance(p.state.poses[4], p.truth.poses[4]), 1e-4);
}

TEST(SchurSolver, NothingToDoAndAskedToStop) {
  Problem p = MakeProblem(6, 1);
  const CamerasAndPoints before = p.state;
  EXPECT_FALSE(MinimizeReprojection({}, 6, {}, p.state).success);
  EXPECT_FALSE(MinimizeReprojection(p.measurements, 0, {}, p.state).success);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(
      MinimizeReprojection(p.measurements, 6, {.stop = stop.get_token()}, p.state).success);
  EXPECT_EQ(p.state.points, before.points);
}

TEST(SchurSolver, APointBehindItsCamerasDoesNoHarm) {
  Problem p = MakeProblem(6, 0.3);
  p.state.points[7] = p.state.poses[0].Inverse() * Eigen::Vector3d(0, 0, -1);
  ASSERT_TRUE(MinimizeReprojection(p.measurements, 6,
                                   {.max_iterations = 20, .tolerance = 1e-6, .huber_chi2 = 5.991},
                                   p.state)
                  .success);
  EXPECT_LT(PoseError(p), 0.02) << PoseError(MakeProblem(6, 0.3));
}

}  // namespace
}  // namespace oaslam
