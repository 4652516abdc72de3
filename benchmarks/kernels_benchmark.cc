// The kernels of a frame, on a rendered texture of 640 x 480, beside OpenCV's where it has the same
// one.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/features/band_search.h"
#include "oaslam/features/orb_extractor.h"
#include "oaslam/features/orb_kernels.h"
#include "oaslam/features/resize.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/matching/projection_search.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/tracking/pose_tracking.h"
#include "picture.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

// tools/bench counts instructions by runs of a known number of calls.
void FixedCalls(benchmark::internal::Benchmark* benchmark) {
  if (const char* calls = std::getenv("OASLAM_BENCH_CALLS"))
    benchmark->Iterations(std::atoi(calls));
}

const cv::Mat& Scene() {
  static const cv::Mat scene = [] {
    Rng rng(1);
    cv::Mat image = Rectangles(rng);
    cv::Mat noise(image.size(), CV_8UC1);
    for (int y = 0; y < noise.rows; ++y)
      for (int x = 0; x < noise.cols; ++x)
        noise.at<uint8_t>(y, x) = static_cast<uint8_t>(rng.Index(12));
    cv::GaussianBlur(image + noise, image, {3, 3}, 0.8);
    return image;
  }();
  return scene;
}

void Fast(benchmark::State& state) {
  std::vector<uint8_t> scores;
  for (auto _ : state) benchmark::DoNotOptimize(DetectFast(ViewOf(Scene()), 7, scores));
}
BENCHMARK(Fast)->Apply(FixedCalls);

void FastOfOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  std::vector<cv::KeyPoint> corners;
  for (auto _ : state) cv::FAST(Scene(), corners, 7, true);
}
BENCHMARK(FastOfOpenCv)->Apply(FixedCalls);

void Blur(benchmark::State& state) {
  GreyBuffer blurred(Scene().cols, Scene().rows);
  for (auto _ : state) BlurGaussian7(ViewOf(Scene()), blurred.Row(0), blurred.step());
}
BENCHMARK(Blur)->Apply(FixedCalls);

void BlurOfOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  cv::Mat blurred;
  for (auto _ : state) cv::GaussianBlur(Scene(), blurred, {7, 7}, 2, 2, cv::BORDER_REFLECT_101);
}
BENCHMARK(BlurOfOpenCv)->Apply(FixedCalls);

// From a level of the pyramid to the next.
void Resize(benchmark::State& state) {
  GreyBuffer resized(533, 400);
  for (auto _ : state) ResizeLinear(ViewOf(Scene()), resized);
}
BENCHMARK(Resize)->Apply(FixedCalls);

void ResizeOfOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  cv::Mat resized;
  for (auto _ : state) cv::resize(Scene(), resized, {533, 400}, 0, 0, cv::INTER_LINEAR);
}
BENCHMARK(ResizeOfOpenCv)->Apply(FixedCalls);

// To a working resolution.
void Averaging(benchmark::State& state) {
  GreyBuffer resized(370, 277);
  for (auto _ : state) ResizeByArea(ViewOf(Scene()), resized);
}
BENCHMARK(Averaging)->Apply(FixedCalls);

void AveragingOfOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  cv::Mat resized;
  for (auto _ : state) cv::resize(Scene(), resized, {370, 277}, 0, 0, cv::INTER_AREA);
}
BENCHMARK(AveragingOfOpenCv)->Apply(FixedCalls);

// For one key point.
void Orientation(benchmark::State& state) {
  const uint8_t* center = Scene().ptr<uint8_t>(240) + 320;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        DirectionOf(PatchMoments(center, static_cast<std::ptrdiff_t>(Scene().step))));
}
BENCHMARK(Orientation)->Apply(FixedCalls);

void Description(benchmark::State& state) {
  const uint8_t* center = Scene().ptr<uint8_t>(240) + 320;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        Describe(center, static_cast<std::ptrdiff_t>(Scene().step), {800, 640}));
}
BENCHMARK(Description)->Apply(FixedCalls);

void Extraction(benchmark::State& state) {
  cv::setNumThreads(1);
  OrbExtractor extractor({},
                         {.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240});
  for (auto _ : state) benchmark::DoNotOptimize(extractor.Extract(ViewOf(Scene()), 1000));
}
BENCHMARK(Extraction)->Unit(benchmark::kMicrosecond)->Apply(FixedCalls);

void ExtractionOfOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto orb = cv::ORB::create(1000, 1.2F, 8, 31, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  for (auto _ : state) orb->detectAndCompute(Scene(), {}, keypoints, descriptors);
}
BENCHMARK(ExtractionOfOpenCv)->Unit(benchmark::kMicrosecond)->Apply(FixedCalls);

// One descriptor against a thousand.
void Hamming(benchmark::State& state) {
  Rng rng(2);
  std::vector<Descriptor> descriptors(1000);
  for (Descriptor& d : descriptors) d = synthetic::RandomDescriptor(rng);
  for (auto _ : state) {
    int best = 256;
    for (const Descriptor& d : descriptors)
      best = std::min(best, HammingDistance(descriptors[0], d) + 1);
    benchmark::DoNotOptimize(best);
  }
}
BENCHMARK(Hamming)->Apply(FixedCalls);

// One epipolar line among a thousand points.
void BandSearch(benchmark::State& state) {
  Rng rng(3);
  BandPoints points;
  for (int i = 0; i < 1000; ++i)
    points.Add({static_cast<float>(rng.Uniform(0, 640)), static_cast<float>(rng.Uniform(0, 480))},
               4);
  std::vector<int32_t> found;
  for (auto _ : state) benchmark::DoNotOptimize(PointsNearLine(points, {0.6F, 0.8F, -400}, found));
}
BENCHMARK(BandSearch)->Apply(FixedCalls);

struct Tracked {
  synthetic::World world = synthetic::MakeWorld({});
  synthetic::MappedWorld mapped = synthetic::MakeMap(world, {});
  Frame frame;
  Tracked() {
    Rng rng(9);
    frame.camera = std::make_shared<const Camera>(world.camera);
    frame.features = synthetic::MakeView(world, synthetic::PoseOnArc({}, 3), {}, rng).features;
  }
};

void FollowLastFrame(benchmark::State& state) {
  const Tracked t;
  const Keyframe& last = t.mapped.map.keyframes.At(KeyframeId(4));
  for (auto _ : state)
    benchmark::DoNotOptimize(TrackFromLastFrame(t.frame, t.mapped.map, *last.features,
                                                last.landmarks, synthetic::PoseOnArc({}, 2.5), 15));
}
BENCHMARK(FollowLastFrame)->Unit(benchmark::kMicrosecond)->Apply(FixedCalls);

void PoseRefinement(benchmark::State& state) {
  const Tracked t;
  Rng rng(5);
  std::vector<PointObservation> observations;
  const Rigid3 truth = synthetic::PoseOnArc({}, 3);
  for (size_t i = 0; i < 300; ++i)
    observations.push_back({t.world.points[i],
                            ProjectIdeal(t.world.camera, truth * t.world.points[i]) +
                                Eigen::Vector2d(rng.Gaussian(1), rng.Gaussian(i % 10 ? 1 : 40)),
                            1});
  for (auto _ : state)
    benchmark::DoNotOptimize(
        RefinePose(t.world.camera, synthetic::PoseOnArc({}, 2.8), observations));
}
BENCHMARK(PoseRefinement)->Unit(benchmark::kMicrosecond)->Apply(FixedCalls);

}  // namespace
}  // namespace oaslam
