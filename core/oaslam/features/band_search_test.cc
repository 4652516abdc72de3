#include "oaslam/features/band_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

TEST(BandSearch, FindsWhatTheDefinitionFinds) {
  Rng rng(1);
  std::vector<int32_t> scratch;
  size_t sum = 0;
  for (const int count : {0, 1, 7, 8, 9, 500, 1001}) {
    BandPoints points;
    for (int i = 0; i < count; ++i)
      points.Add({static_cast<float>(rng.Uniform(0, 640)), static_cast<float>(rng.Uniform(0, 480))},
                 static_cast<float>(rng.Uniform(0, 20)));
    for (int trial = 0; trial < 20; ++trial) {
      const double angle = rng.Uniform(0, 7);
      const Eigen::Vector3f line(static_cast<float>(std::cos(angle)),
                                 static_cast<float>(std::sin(angle)),
                                 static_cast<float>(rng.Uniform(-500, 100)));
      std::vector<int32_t> expected;
      for (int i = 0; i < count; ++i)
        if (std::abs(line.x() * points.x[i] + line.y() * points.y[i] + line.z()) <=
            points.tolerance[i])
          expected.push_back(i);
      const auto found = PointsNearLine(points, line, scratch);
      EXPECT_EQ(std::vector<int32_t>(found.begin(), found.end()), expected);
      sum += expected.size();
    }
  }
  EXPECT_GT(sum, 300U);
}

TEST(BandSearch, NoNumberIsNowhere) {
  BandPoints points;
  for (int i = 0; i < 20; ++i) points.Add({std::numeric_limits<float>::quiet_NaN(), 0}, 1e9F);
  std::vector<int32_t> scratch;
  EXPECT_TRUE(PointsNearLine(points, {1, 0, 0}, scratch).empty());
}

}  // namespace
}  // namespace oaslam
