// Corners of an image of 640 x 480, described on one thread. What one corner takes is nearly all
// that of the maps; what 1000 take above it is that of sampling and of the head.
#include <benchmark/benchmark.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "oaslam/description/corner_describer.h"
#include "picture.h"

namespace oaslam {
namespace {

// Corners anywhere, on the lowest `levels` levels of ORB's pyramid.
std::vector<ScaledCorner> RandomCorners(int count, int levels, Rng& rng) {
  std::vector<ScaledCorner> corners;
  for (int i = 0; i < count; ++i)
    corners.push_back({{static_cast<float>(rng.Index(640)), static_cast<float>(rng.Index(480))},
                       std::pow(1.2F, static_cast<float>(i % levels))});
  return corners;
}

void DescribeCorners(benchmark::State& state) {
  cv::setNumThreads(1);
  Rng rng(1);
  const cv::Mat picture = Rectangles(rng);
  const GreyImage image{picture.data, static_cast<std::ptrdiff_t>(picture.step), picture.cols,
                        picture.rows};
  const auto corners =
      RandomCorners(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), rng);
  CornerDescriber describer;
  for (auto _ : state) benchmark::DoNotOptimize(describer.Describe(image, corners));
}
// 8 levels are in all three octaves, 2 in the first only.
BENCHMARK(DescribeCorners)
    ->ArgNames({"corners", "levels"})
    ->ArgsProduct({{1, 1000}, {2}})
    ->Args({1000, 8})
    ->Unit(benchmark::kMillisecond);

void MakeDescriber(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(CornerDescriber());
}
BENCHMARK(MakeDescriber)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace oaslam
