#include "oaslam/bundle/pose_graph.h"

#include <gtest/gtest.h>

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

// What lies beyond a weak edge is 1.3 times too large. An edge back tells where the last camera is;
// taken for one that tells the scale, too, it would keep the wrong one.
TEST(PoseGraph, AnEdgeMayLeaveTheScaleFree) {
  constexpr int kCount = 10, kLost = 5;
  std::vector<Similarity> truth, nodes;
  for (int i = 0; i < kCount; ++i) truth.push_back(OnCircle(0.3 * i));
  const Eigen::Vector3d about = Center(truth[kLost]);
  const Similarity grown(1.3, Eigen::Quaterniond::Identity(), -0.3 * about);
  for (int i = 0; i < kCount; ++i)
    nodes.emplace_back(i <= kLost ? truth[i] : Similarity((truth[i] * grown.Inverse()).AsPose()));
  const auto scale_at_end = [&](bool is_scale_known) {
    std::vector<PoseGraphEdge> edges;
    for (int i = 1; i < kCount; ++i)
      edges.push_back(
          {i - 1, i, nodes[i] * nodes[i - 1].Inverse(), i == kLost + 1 ? 0.01 : 1.0, 2});
    edges.push_back({0, kCount - 1, truth.back() * truth.front().Inverse(), 1, 2, is_scale_known});
    std::vector<char> fixed(kCount, 0);
    fixed.front() = 1;
    const std::vector<Similarity> moved = OptimizePoseGraph(nodes, edges, fixed).value();
    EXPECT_LT((Center(moved.back()) - Center(truth.back())).norm(), 0.05);
    return moved.back().scale;
  };
  EXPECT_NEAR(scale_at_end(true), 1, 0.03);
  EXPECT_GT(scale_at_end(false), 1.1);
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
