#include "oaslam/bundle/pose_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

Eigen::Vector3d Center(const Similarity& cam_from_world) {
  return cam_from_world.Inverse() * Eigen::Vector3d(0, 0, 0);
}

Similarity OnCircle(double angle) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
  return Similarity(1, turn, Eigen::Vector3d(0, 0, 2));  // 2 units from the middle, looking at it
}

TEST(Similarity, ProductsAndInverseAreThoseOfTheMaps) {
  Rng rng(1);
  const auto random = [&] {
    const Eigen::Vector3d axis(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(-1, 1));
    return Similarity(rng.Uniform(0.5, 2),
                      Eigen::Quaterniond(Eigen::AngleAxisd(rng.Uniform(0, 3), axis.normalized())),
                      3 * axis);
  };
  for (int i = 0; i < 20; ++i) {
    const Similarity a = random(), b = random();
    const Eigen::Vector3d x(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(-1, 1));
    EXPECT_LT(((a * b) * x - a * (b * x)).norm(), 1e-12);
    EXPECT_LT((a.Inverse() * (a * x) - x).norm(), 1e-12);
    const Eigen::Vector3d in_pose = a.AsPose() * x, in_cam = a * x;
    EXPECT_LT((in_pose.normalized() - in_cam.normalized()).norm(), 1e-12);
  }
}

// A full circle whose scale and heading drift at every step.
TEST(PoseGraph, AnEdgeAcrossTheLoopTakesBackTheDrift) {
  constexpr int kCount = 40;
  std::vector<Similarity> truth, drifted;
  for (int i = 0; i < kCount; ++i) truth.push_back(OnCircle(2 * std::numbers::pi * i / kCount));
  drifted.push_back(truth[0]);
  const Similarity error(
      1.01, Eigen::Quaterniond(Eigen::AngleAxisd(0.004, Eigen::Vector3d(1, 2, 0).normalized())),
      {0.004, 0, 0});
  std::vector<PoseGraphEdge> edges;
  for (int i = 1; i < kCount; ++i) {
    const Similarity step = error * truth[i] * truth[i - 1].Inverse();
    drifted.push_back(step * drifted.back());
    edges.push_back({i - 1, i, step, 1, 2});
  }
  const auto worst = [&](const std::vector<Similarity>& nodes) {
    double most = 0;
    for (int i = 0; i < kCount; ++i)
      most = std::max(most, (Center(nodes[i]) - Center(truth[i])).norm());
    return most;
  };
  std::vector<Similarity> start = drifted;
  start.back() = truth.back();
  std::vector<char> fixed(kCount, 0);
  fixed.front() = fixed.back() = 1;
  ASSERT_GT(worst(drifted), 0.5);
  const std::vector<Similarity> moved = OptimizePoseGraph(start, edges, fixed).value();
  EXPECT_LT(worst(moved), 0.2 * worst(drifted));
  EXPECT_LT((Center(moved.back()) - Center(truth.back())).norm(), 1e-12);
  ASSERT_GT(drifted.back().scale, 1.4);
  for (const Similarity& node : moved) EXPECT_NEAR(node.scale, 1, 0.03);
}

TEST(PoseGraph, WhatHoldsAlreadyStays) {
  std::vector<Similarity> nodes;
  std::vector<PoseGraphEdge> edges;
  for (int i = 0; i < 10; ++i) nodes.push_back(OnCircle(0.1 * i));
  for (int i = 1; i < 10; ++i) edges.push_back({i - 1, i, nodes[i] * nodes[i - 1].Inverse()});
  const std::vector<Similarity> moved =
      OptimizePoseGraph(nodes, edges, std::vector<char>(10, 0)).value();
  for (int i = 0; i < 10; ++i) EXPECT_LT((Center(moved[i]) - Center(nodes[i])).norm(), 1e-9);
}

}  // namespace
}  // namespace oaslam
