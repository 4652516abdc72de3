#include "oaslam/relocalization/object_grid.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

std::vector<int> NearByLooking(const std::vector<Eigen::Vector3d>& points,
                               const Eigen::Vector3d& place, double distance) {
  std::vector<int> near;
  for (int i = 0; i < static_cast<int>(points.size()); ++i)
    if ((points[i] - place).norm() < distance) near.push_back(i);
  return near;
}

TEST(ObjectGrid, FindsAllThatAreNear) {
  Rng rng(1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 500; ++i)
    points.emplace_back(rng.Uniform(-20, 20), rng.Uniform(-20, 20), rng.Uniform(-3, 3));
  for (const double cell : {0.5, 3.0, 100.0}) {
    const ObjectGrid grid(points, cell);
    std::vector<int> near;
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d place(rng.Uniform(-20, 20), rng.Uniform(-20, 20), rng.Uniform(-3, 3));
      const double distance = rng.Uniform(0, 12);
      grid.FindNear(place, distance, near);
      std::ranges::sort(near);
      EXPECT_EQ(near, NearByLooking(points, place, distance)) << cell << ' ' << distance;
    }
  }
}

TEST(ObjectGrid, OfNothingFindsNothing) {
  std::vector<int> near{1};
  ObjectGrid({}, 1).FindNear({0, 0, 0}, 5, near);
  EXPECT_TRUE(near.empty());
}

}  // namespace
}  // namespace oaslam
