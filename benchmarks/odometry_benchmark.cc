// The parts of the odometry's time for an image: points followed, a window optimised, and a window
// that is looked through for a better minimum.
#include <benchmark/benchmark.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "oaslam/geometry/pose_step.h"
#include "oaslam/odometry/point_flow.h"
#include "oaslam/odometry/window.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/util/rng.h"
#include "picture.h"

namespace oaslam {
namespace {

constexpr int kPoints = 250;  // about what the odometry follows in a room
constexpr int kImages = 17;   // its window: 15 keyframes and 2 recent images

// A picture that is moved by `shift` pixels.
cv::Mat Moved(const cv::Point2d& shift) {
  Rng rng(1);
  cv::Mat image = Rectangles(rng);
  cv::GaussianBlur(image, image, {3, 3}, 0.8);
  const cv::Mat move = (cv::Mat_<double>(2, 3) << 1, 0, shift.x, 0, 1, shift.y);
  cv::warpAffine(image, image, move, image.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return image;
}

void Tracks(benchmark::State& state) {
  const cv::Mat images[] = {Moved({0, 0}), Moved({6.3, 2.1}), Moved({11.8, 3.9})};
  std::vector<GreyPyramid> pyramids;
  for (const cv::Mat& image : images) pyramids.emplace_back(ViewOf(image), 4);
  Rng rng(2);
  std::vector<Eigen::Vector2f> at_keyframe;
  for (int i = 0; i < kPoints; ++i)
    at_keyframe.emplace_back(40 + rng.Index(560), 40 + rng.Index(400));
  std::vector<PointToFollow> points;
  for (const Eigen::Vector2f& px : at_keyframe) {
    const Eigen::Vector2f now = px + Eigen::Vector2f(6.3F, 2.1F);
    points.push_back({now, now + Eigen::Vector2f(4, 1), &pyramids[0], px});
  }
  for (auto _ : state) benchmark::DoNotOptimize(FollowPoints(points, pyramids[1], pyramids[2]));
}
BENCHMARK(Tracks)->Unit(benchmark::kMicrosecond);

// A camera that walks by points in depth and knows its motion and the depths to some per cent.
Window Walked() {
  Rng rng(3);
  Window window;
  std::vector<Rigid3> truth;
  for (int k = 0; k < kImages; ++k) {
    const Eigen::Quaterniond rotation = RotationOf({0.004 * k, -0.01 * k, 0.002 * k});
    truth.emplace_back(Rigid3::Rotation(rotation),
                       rotation * -Eigen::Vector3d(0.05 * k, 0.01 * k, 0.03 * k));
    Rigid3 believed = truth.back();
    if (k > 0)
      believed.translation +=
          0.01 * Eigen::Vector3d(rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1));
    window.images.push_back({k, k / 10.0, believed, k < kImages - 2, k == 0});
  }
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3d x = std::exp(rng.Uniform(std::log(0.6), std::log(5.0))) *
                              Eigen::Vector3d(rng.Uniform(-0.5, 0.5), rng.Uniform(-0.4, 0.4), 1);
    // Half of the window sees a point, in the mean.
    const int first = rng.Index(kImages / 2), last = kImages / 2 + rng.Index(kImages / 2);
    const Eigen::Vector3d there = truth[first] * x;
    WindowPoint point{first, Eigen::Vector2f::Zero(), there.hnormalized()};
    point.inverse_depth = point.prior_inverse_depth = std::exp(rng.Gaussian(0.05)) / there.z();
    for (int k = first + 1; k <= last; ++k)
      point.sightings.push_back({k, Eigen::Vector2f::Zero(),
                                 (truth[k] * x).hnormalized() +
                                     6e-4 * Eigen::Vector2d(rng.Gaussian(1), rng.Gaussian(1))});
    window.points.push_back(std::move(point));
  }
  return window;
}

void WindowOptimized(benchmark::State& state) {
  const Window window = Walked();
  const WindowProblem made = ProblemOf(window, {}, false);
  InverseDepthSolver solver;
  for (auto _ : state) {
    InverseDepthState poses = made.StateOf(window);
    benchmark::DoNotOptimize(
        solver.Minimize(made.problem, {.max_iterations = 4, .tolerance = 1e-4}, poses, true));
  }
}
BENCHMARK(WindowOptimized)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace oaslam
