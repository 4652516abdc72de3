#include "oaslam/bundle/motion_cost.h"

#include <gtest/gtest.h>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/bundle/reprojection_cost.h"
#include "oaslam/bundle/schur_solver.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

MotionMeasurement Measured(const std::vector<Rigid3>& poses, int from, int to) {
  return {from, to, poses[to] * poses[from].Inverse(), 0.01, 0.002};
}

TEST(MotionCost, DerivativesAreThoseOfTheError) {
  const synthetic::World world = synthetic::MakeWorld({});
  const MotionMeasurement measured = Measured(world.cam_from_world, 2, 5);
  const Rigid3 from = world.cam_from_world[2], to = world.cam_from_world[5];
  EXPECT_LT(MotionError(measured, from, to).norm(), 1e-6);
  const MotionDerivatives derivatives = DerivativesOf(measured);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    PoseVector step = PoseVector::Zero();
    step[i] = kStep;
    const PoseVector by_from = MotionError(measured, Moved(from, step), to) / kStep,
                     by_to = MotionError(measured, from, Moved(to, step)) / kStep;
    EXPECT_LT((by_from - derivatives.by_from.col(i)).norm(), 1e-2);
    EXPECT_LT((by_to - derivatives.by_to.col(i)).norm(), 1e-2);
  }
}

// In a chain of cameras that see nothing, each with a motion from the one before, the motions alone
// put the cameras in their places, by either solver.
TEST(MotionCost, HoldsCamerasThatSeeNothing) {
  const synthetic::World world = synthetic::MakeWorld({});
  Rng rng(3);
  CamerasAndPoints state;
  state.poses = {world.cam_from_world[1], world.cam_from_world[2], world.cam_from_world[0]};
  state.cameras.assign(3, &world.camera);
  state.points = {world.points[0]};
  // One point seen by the fixed camera: without any there is nothing to solve.
  const std::vector<PointMeasurement> seen = {{2, 0, {320, 240}, 1}};
  const std::vector<MotionMeasurement> motions = {
      {2, 0, world.cam_from_world[1] * world.cam_from_world[0].Inverse(), 0.01, 0.002},
      {0, 1, world.cam_from_world[2] * world.cam_from_world[1].Inverse(), 0.01, 0.002}};
  for (int k = 0; k < 2; ++k) state.poses[k] = synthetic::Disturb(state.poses[k], 0.05, 0.02, rng);
  ASSERT_TRUE(
      MinimizeReprojection(seen, 2, {.max_iterations = 30, .tolerance = 1e-9}, state, motions)
          .success);
  for (int k = 0; k < 2; ++k)
    EXPECT_LT(CenterDistance(state.poses[k], world.cam_from_world[k + 1]), 1e-3);
}

TEST(MotionCost, CeresGetsTheSameDerivatives) {
  const synthetic::World world = synthetic::MakeWorld({});
  const MotionMeasurement measured = Measured(world.cam_from_world, 0, 1);
  const PoseBlock from = ToBlock(world.cam_from_world[0]), to = ToBlock(world.cam_from_world[1]);
  const MotionDerivatives derivatives = DerivativesOf(measured);
  const double* blocks[] = {from.data(), to.data()};
  PoseVector residuals;
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor> by_block[2];
  double* jacobians[] = {by_block[0].data(), by_block[1].data()};
  MotionCost(measured, std::nullopt, std::nullopt).Evaluate(blocks, residuals.data(), jacobians);
  Eigen::Matrix<double, 7, 6, Eigen::RowMajor> block_by_step;
  PoseManifold().PlusJacobian(from.data(), block_by_step.data());
  EXPECT_LT((by_block[0] * block_by_step - derivatives.by_from).norm(), 1e-6);
  PoseManifold().PlusJacobian(to.data(), block_by_step.data());
  EXPECT_LT((by_block[1] * block_by_step - derivatives.by_to).norm(), 1e-6);
  // A fixed pose has no block.
  const double* one[] = {to.data()};
  double* of_one[] = {by_block[0].data()};
  MotionCost(measured, FromBlock(from), std::nullopt).Evaluate(one, residuals.data(), of_one);
  EXPECT_EQ(by_block[0], by_block[1]);
}

}  // namespace
}  // namespace oaslam
