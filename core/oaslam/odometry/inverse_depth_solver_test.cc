#include "oaslam/odometry/inverse_depth_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdint>

#include "cameras.h"
#include "instruction_sets.h"
#include "oaslam/estimation/huber.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/odometry/patch_edge.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

Rigid3 Pose(const Eigen::Vector3d& center, double turn_rad) {
  const Eigen::Quaterniond rotation = RotationOf({0.1 * turn_rad, turn_rad, 0});
  return Rigid3(Rigid3::Rotation(rotation), rotation * -center);
}

// Six cameras on a way of 0.5 that turn by 10 degrees; 80 points at depths from 1 to 50, seen first
// by one of the first three. The first two cameras are held.
struct Scene {
  InverseDepthProblem problem;
  InverseDepthState truth;

  explicit Scene(double noise_px = 0, uint64_t noise_seed = 5) {
    constexpr int kCameras = 6, kPoints = 80;
    constexpr double kFocal = 500;
    Rng rng(4), noise_rng(noise_seed);
    std::vector<Rigid3> poses;
    for (int k = 0; k < kCameras; ++k)
      poses.push_back(Pose({0.1 * k, 0.03 * k * k, 0.02 * k}, 0.035 * k));
    // The free poses come first: 2, 3, 4, 5, then 0 and 1.
    std::vector<int> order{2, 3, 4, 5, 0, 1}, pose_of{4, 5, 0, 1, 2, 3};
    for (const int k : order) truth.poses.push_back(poses[k]);
    problem.free_poses = 4;
    problem.corner_chi2 = 0.5;
    problem.huber_chi2 = 2.25;
    for (int i = 0; i < kPoints; ++i) {
      const int anchor = i % 3;
      const double depth = std::exp(rng.Uniform(0, std::log(50)));
      const Eigen::Vector2d ray(rng.Uniform(-0.5, 0.5), rng.Uniform(-0.4, 0.4));
      problem.points.push_back({pose_of[anchor], ray, 0.5, 1});
      truth.inverse_depths.push_back(1 / depth);
      for (int k = 0; k < kCameras; ++k) {
        if (k == anchor) continue;
        const Eigen::Vector3d x = ScaledPoint(poses[k] * poses[anchor].Inverse(), ray, 1 / depth);
        const Eigen::Vector2d noise(noise_rng.Gaussian(noise_px), noise_rng.Gaussian(noise_px));
        problem.measurements.push_back({i, pose_of[k], x.hnormalized() + noise / kFocal,
                                        kFocal / 0.7 * EdgeOf(i).RootOfInformation()});
      }
    }
  }

  // Every second point is on an edge, along which it is known a quarter as well.
  static PatchEdge EdgeOf(int point) {
    return {{std::cos(point), std::sin(point)}, point % 2 == 0 ? 4.0 : 1.0};
  }

  InverseDepthState Disturbed() const {
    Rng rng(9);
    InverseDepthState state = truth;
    for (int k = 0; k < problem.free_poses; ++k) {
      PoseVector step;
      for (int i = 0; i < 6; ++i) step[i] = rng.Gaussian(0.01);
      state.poses[k] = Moved(state.poses[k], step);
    }
    for (double& d : state.inverse_depths) d = std::max(0.0, d + rng.Gaussian(0.1));
    return state;
  }

  double WorstCenter(const InverseDepthState& state) const {
    return CenterErrorsOf(state.poses, truth.poses).worst;
  }
};

const SchurOptions kThorough{.max_iterations = 50, .tolerance = 1e-10};

TEST(InverseDepthSolver, FindsTheTruthOfExactMeasurements) {
  Scene scene;
  for (DepthPrior& p : scene.problem.points) p.sigma = 1e6;
  InverseDepthState state = scene.Disturbed();
  const InverseDepthReport report = InverseDepthSolver().Minimize(scene.problem, kThorough, state);
  EXPECT_TRUE(report.solver.success);
  EXPECT_LT(report.solver.cost, 1e-6);
  EXPECT_LT(scene.WorstCenter(state), 1e-5);
  for (size_t i = 0; i < state.inverse_depths.size(); ++i)
    EXPECT_NEAR(state.inverse_depths[i], scene.truth.inverse_depths[i], 1e-5);
}

// At a minimum no small step of any parameter lowers the cost: the derivatives are right.
TEST(InverseDepthSolver, EndsAtAMinimumWithAllPriors) {
  Scene scene(1);
  scene.problem.velocities = {{5, 0, 1, 0.1, 0.1, 0.3}, {0, 1, 2, 0.1, 0.1, 0.3}};
  scene.problem.length = LengthPrior{4, 2, 0.45, 0.01};
  // In all orders of held and free poses; one of them far beyond Huber's threshold.
  scene.problem.turn_rates = {
      {4, 5, 0, 0.1, 0.1, 0.1}, {5, 0, 1, 0.1, 0.2, 0.002}, {2, 3, 1, 0.2, 0.1, 0.05}};
  // Of a held and a free pose, and of two free ones in both orders; wrong by some degrees.
  for (const auto& [first, second] : {std::pair{5, 0}, {0, 1}, {3, 2}}) {
    const Rigid3 turn = scene.truth.poses[second] * scene.truth.poses[first].Inverse();
    const Eigen::Quaterniond wrong = RotationOf({0.05, -0.1, 0.02});
    scene.problem.rotations.push_back({first, second, {turn.rotation * wrong, 1e-4}});
  }
  InverseDepthState state = scene.Disturbed();
  InverseDepthSolver().Minimize(scene.problem, kThorough, state);
  const double best = CostOf(scene.problem, state);
  constexpr double kStep = 1e-4;
  for (int k = 0; k < scene.problem.free_poses; ++k)
    for (int i = 0; i < 6; ++i)
      for (const double sign : {-1, 1}) {
        InverseDepthState moved = state;
        moved.poses[k] = Moved(moved.poses[k], sign * kStep * PoseVector::Unit(i));
        EXPECT_GT(CostOf(scene.problem, moved), best) << k << " " << i;
      }
  for (size_t i = 0; i < state.inverse_depths.size(); ++i)
    for (const double sign : {-1, 1}) {
      InverseDepthState moved = state;
      moved.inverse_depths[i] += sign * 10 * kStep;
      if (moved.inverse_depths[i] < scene.problem.least_inverse_depth) continue;
      EXPECT_GT(CostOf(scene.problem, moved), best) << i;
    }
}

// Points that have slid along their edges hardly change the poses, where edges are known as such.
TEST(InverseDepthSolver, ASlideAlongAnEdgeCountsLess) {
  const auto worst_center = [](double slide) {
    Scene scene;
    for (DepthMeasurement& m : scene.problem.measurements) {
      const PatchEdge edge{Scene::EdgeOf(m.point).along, slide};
      m.ray += 0.006 * std::abs(edge.along.y()) * edge.along;  // 3 px at most, downwards or up
      m.root_information = 700 * edge.RootOfInformation();
    }
    InverseDepthState state = scene.truth;
    InverseDepthSolver().Minimize(scene.problem, kThorough, state);
    return scene.WorstCenter(state);
  };
  EXPECT_LT(worst_center(20), 0.3 * worst_center(1));
}

// The error of the scale that is foretold is the one that noise makes.
TEST(InverseDepthSolver, ForetellsHowWellTheScaleIsHeld) {
  constexpr int kRuns = 60;
  double sum = 0, foretold = 0;
  for (int run = 0; run < kRuns; ++run) {
    Scene scene(0.7, 100 + run);
    scene.problem.corner_chi2 = 0;
    const auto is_near = [&](int point) { return scene.truth.inverse_depths[point] > 0.3; };
    for (DepthMeasurement& m : scene.problem.measurements) {
      m.root_information = 500 / 0.7 * Eigen::Matrix2d::Identity();
      m.is_outlier = !is_near(m.point);  // far points would count by their own errors
    }
    InverseDepthState state = scene.truth;
    const InverseDepthReport report =
        InverseDepthSolver().Minimize(scene.problem, kThorough, state, true);
    const Eigen::VectorXd& by_poses = report.scale.by_poses;
    foretold += report.scale.variance + by_poses.dot(report.information.ldlt().solve(by_poses));
    double off = 0;
    int near = 0;
    for (size_t i = 0; i < state.inverse_depths.size(); ++i) {
      if (!is_near(static_cast<int>(i))) continue;
      off += std::log(state.inverse_depths[i] / scene.truth.inverse_depths[i]);
      ++near;
    }
    sum += std::pow(off / near, 2);
  }
  EXPECT_NEAR(std::sqrt(sum / foretold), 1, 0.4);
}

TEST(InverseDepthSolver, WithoutPointsInViewNoScaleIsHeld) {
  Scene scene;
  for (DepthMeasurement& m : scene.problem.measurements) m.is_outlier = m.pose == 3;
  InverseDepthState state = scene.truth;
  EXPECT_EQ(InverseDepthSolver().Minimize(scene.problem, kThorough, state, true).scale.variance, 1);
}

// Without points in view a pose goes on turning as those before it.
TEST(InverseDepthSolver, ATurnGoesOn) {
  Scene scene;
  std::erase_if(scene.problem.measurements, [](const DepthMeasurement& m) { return m.pose == 3; });
  scene.problem.turn_rates = {{1, 2, 3, 0.1, 0.1, 1e-3}};  // the scene turns evenly
  InverseDepthState state = scene.Disturbed();
  InverseDepthSolver().Minimize(scene.problem, kThorough, state);
  EXPECT_LT(state.poses[3].rotation.angularDistance(scene.truth.poses[3].rotation), 1e-3);
}

// Without points in view a pose turns as the gyroscope says.
TEST(InverseDepthSolver, ARotationPriorIsEnoughForARotation) {
  Scene scene;
  std::erase_if(scene.problem.measurements, [](const DepthMeasurement& m) { return m.pose == 3; });
  const Rigid3 turn = scene.truth.poses[3] * scene.truth.poses[2].Inverse();
  scene.problem.rotations = {{2, 3, {turn.rotation, 1e-6}}};
  InverseDepthState state = scene.Disturbed();
  InverseDepthSolver().Minimize(scene.problem, kThorough, state);
  EXPECT_LT(state.poses[3].rotation.angularDistance(scene.truth.poses[3].rotation), 1e-3);
}

TEST(InverseDepthSolver, PosesFollowTheirCovariance) {
  Scene scene(0.7);
  InverseDepthState state = scene.truth;
  const InverseDepthReport report =
      InverseDepthSolver().Minimize(scene.problem, kThorough, state, true);
  const Eigen::MatrixXd covariance = report.information.inverse();
  double nees = 0;  // normalised estimation error squared: 6 for each pose
  Eigen::VectorXd error(6 * scene.problem.free_poses);
  for (int k = 0; k < scene.problem.free_poses; ++k) {
    const Rigid3 off = scene.truth.poses[k] * state.poses[k].Inverse();
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(off.rotation));
    error.segment<6>(6 * k) << off.translation, turn.angle() * turn.axis();
  }
  nees = error.dot(covariance.inverse() * error) / static_cast<double>(error.size());
  EXPECT_GT(nees, 0.3);
  EXPECT_LT(nees, 3);
}

TEST(InverseDepthSolver, PointsAtInfinityHoldTheRotation) {
  Scene scene;
  for (size_t i = 0; i < scene.problem.points.size(); ++i) {
    scene.truth.inverse_depths[i] = 0;
    scene.problem.points[i].inverse_depth = 0;
  }
  for (DepthMeasurement& s : scene.problem.measurements)
    s.ray = ScaledPoint(scene.truth.poses[s.pose] *
                            scene.truth.poses[scene.problem.points[s.point].anchor].Inverse(),
                        scene.problem.points[s.point].ray, 0)
                .hnormalized();
  scene.problem.velocities = {{4, 5, 0, 0.1, 0.1, 1},
                              {5, 0, 1, 0.1, 0.1, 1},
                              {0, 1, 2, 0.1, 0.1, 1},
                              {1, 2, 3, 0.1, 0.1, 1}};
  InverseDepthState state = scene.Disturbed();
  for (double& d : state.inverse_depths) d = 0;
  EXPECT_TRUE(InverseDepthSolver().Minimize(scene.problem, kThorough, state).solver.success);
  for (int k = 0; k < scene.problem.free_poses; ++k)
    EXPECT_LT(state.poses[k].rotation.angularDistance(scene.truth.poses[k].rotation), 1e-4);
}

TEST(InverseDepthSolver, OutliersCountOnlyWhereAsked) {
  Scene scene;
  DepthMeasurement& wrong = scene.problem.measurements[10];
  wrong.ray.x() += 0.1;
  wrong.is_outlier = true;
  InverseDepthState state = scene.truth;
  const double without = CostOf(scene.problem, state);
  EXPECT_NEAR(CostOf(scene.problem, state, 16.0) - without,
              LossOf(16.0, scene.problem.huber_chi2).cost, 1e-9);
  InverseDepthSolver().Minimize(scene.problem, kThorough, state);
  EXPECT_LT(scene.WorstCenter(state), 0.02);  // the priors of the depths move it
}

TEST(InverseDepthSolver, SearchFindsTheNearestCandidate) {
  const Scene scene;
  InverseDepthState state = scene.truth;
  const std::vector<double> candidates{0, 0.1, 0.3, 0.6, 1};
  SearchDepths(candidates, scene.problem, state);
  for (size_t i = 0; i < state.inverse_depths.size(); ++i) {
    double nearest = candidates[0];
    for (const double c : candidates)
      if (std::abs(c - scene.truth.inverse_depths[i]) <
          std::abs(nearest - scene.truth.inverse_depths[i]))
        nearest = c;
    EXPECT_NEAR(state.inverse_depths[i], nearest, 0.31) << i;  // one candidate further at most
  }
}

TEST(InverseDepthSolver, NothingToSolveIsNoSuccess) {
  InverseDepthProblem problem;
  InverseDepthState state;
  EXPECT_FALSE(InverseDepthSolver().Minimize(problem, {}, state).solver.success);
}

class InverseDepthKernelsTest : public EveryInstructionSet {};

// The scene has points behind an image, outliers, and pairs of images whose sightings do not fill
// the last vector.
TEST_P(InverseDepthKernelsTest, GiveTheSameBits) {
  const auto minimized = [] {
    Scene scene(1);
    for (size_t i = 0; i < scene.problem.measurements.size(); i += 7)
      scene.problem.measurements[i].is_outlier = true;
    InverseDepthState state = scene.Disturbed();
    state.inverse_depths[5] = 40;
    SearchDepths(std::array{0.1, 0.5, 1.0, 2.0, 5.0}, scene.problem, state);
    state.inverse_depths[5] = 40;
    InverseDepthReport report = InverseDepthSolver().Minimize(scene.problem, {}, state, true);
    report.variances.insert(report.variances.end(), state.inverse_depths.begin(),
                            state.inverse_depths.end());
    report.variances.push_back(CostOf(scene.problem, state, 9.0));
    return report.variances;
  };
  const std::vector<double> here = minimized();
  TearDown();  // the one that a program takes
  EXPECT_EQ(here, minimized());
}
INSTANTIATE_TEST_SUITE_P(InstructionSets, InverseDepthKernelsTest,
                         testing::ValuesIn(InstructionSets()), NameOfInstructionSet);

}  // namespace
}  // namespace oaslam
