#include "oaslam/features/orb_extractor.h"

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "oaslam/features/keypoint_spread.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

constexpr int kBorder = kPatternReach;
constexpr int kFastBorder = kBorder - kFastRing;  // margin around FAST's own border
// Side of the cells in which a threshold is chosen: smaller ones follow the contrast more closely,
// but take noise for corners in each that has no texture.
constexpr int kCellSize = 32;

GreyImage View(const cv::Mat& image) {
  return {image.ptr<uint8_t>(), static_cast<std::ptrdiff_t>(image.step), image.cols, image.rows};
}

// atan2 of integers is that of doubles. That of floats gives other bits on other processors.
float AngleOf(const Moments& moments) {
  const auto angle = static_cast<float>(std::atan2(moments.y, moments.x));
  return angle < 0 ? angle + 2 * std::numbers::pi_v<float> : angle;
}

}  // namespace

cv::Size WorkingSize(const Camera& camera, int resolution) {
  // The number of pixels decides, whatever the image's shape. Scaling blurs, so that the size is
  // kept where it would change by less than a fifth. An image of less than half the size is
  // enlarged, so that FAST's circle of 7 pixels fits its details; by 2 at most, since details
  // beyond are invented.
  constexpr double kWorthwhile = 1.2, kSmall = 0.5, kMaxEnlargement = 2;
  const double area = static_cast<double>(camera.width) * camera.height;
  double shrink = std::sqrt(area / (0.75 * resolution * resolution));
  if (shrink < kSmall / kWorthwhile)
    shrink = std::max(shrink / kSmall, 1 / kMaxEnlargement);
  else if (shrink < kWorthwhile)
    shrink = 1;
  return {std::max(1, cvRound(camera.width / shrink)),
          std::max(1, cvRound(camera.height / shrink))};
}

OrbExtractor::OrbExtractor(const FeaturesConfig& config, const Camera& camera)
    : config_(config),
      camera_(camera),
      working_size_(WorkingSize(camera, config.resolution)),
      pyramid_(config.levels, config.scale_factor,
               std::sqrt(static_cast<double>(camera.width) * camera.height / working_size_.area())),
      ideal_image_(camera) {}

std::vector<int> OrbExtractor::CountPerLevel(int count) const {
  // A geometric series gives each level the same number of key points for its area.
  const double ratio = 1.0 / pyramid_.factor;
  double wanted =
      pyramid_.levels > 1 ? count * (1 - ratio) / (1 - std::pow(ratio, pyramid_.levels)) : count;
  std::vector<int> counts;
  int sum = 0;
  for (int level = 0; level + 1 < pyramid_.levels; ++level, wanted *= ratio) {
    counts.push_back(static_cast<int>(std::lround(wanted)));
    sum += counts.back();
  }
  counts.push_back(std::max(count - sum, 0));
  return counts;
}

// FAST corners of one level: above the high threshold, and above the low one in cells where that
// finds nothing.
std::vector<Corner> OrbExtractor::DetectCorners(const cv::Mat& image) {
  const cv::Rect inner(kFastBorder, kFastBorder, image.cols - 2 * kFastBorder,
                       image.rows - 2 * kFastBorder);
  std::vector<Corner> corners =
      DetectFast(View(image(inner)), static_cast<uint8_t>(config_.min_fast_threshold), scores_);
  const int columns = inner.width / kCellSize + 1;
  const auto cell_of = [&](const Corner& c) { return c.y / kCellSize * columns + c.x / kCellSize; };
  std::vector<char> is_strong(static_cast<size_t>(columns) * (inner.height / kCellSize + 1), 0);
  for (const Corner& c : corners)
    if (c.score > config_.fast_threshold) is_strong[cell_of(c)] = 1;
  std::erase_if(corners, [&](const Corner& c) {
    return c.score <= config_.fast_threshold && is_strong[cell_of(c)];
  });
  for (Corner& c : corners) {
    c.x += kFastBorder;
    c.y += kFastBorder;
  }
  return corners;
}

cv::Mat OrbExtractor::AtWorkingResolution(const cv::Mat& grey) {
  if (grey.size() == working_size_) return grey;
  cv::resize(grey, working_, working_size_, 0, 0,
             working_size_.width < grey.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
  return working_;
}

Features OrbExtractor::Nothing() const {
  Features features;
  features.pyramid = pyramid_;
  features.bounds = ideal_image_.bounds();
  return features;
}

Features OrbExtractor::Extract(const cv::Mat& grey, int count) {
  OASLAM_CHECK(grey.type() == CV_8UC1 && grey.cols == camera_.width && grey.rows == camera_.height);
  constexpr int kMinWidth = kMinKernelWidth + 2 * kFastBorder, kMinHeight = 2 * kBorder + 9;
  Features features = Nothing();
  const std::vector<int> counts = CountPerLevel(count);
  level_images_.resize(pyramid_.levels);
  level_images_[0] = AtWorkingResolution(grey);
  const cv::Size lowest = level_images_[0].size();
  for (int level = 0; level < pyramid_.levels; ++level) {
    cv::Mat& image = level_images_[level];
    if (level > 0) {
      const auto scale = static_cast<float>(pyramid_.Relative(level));
      const cv::Size size(cvRound(static_cast<float>(lowest.width) / scale),
                          cvRound(static_cast<float>(lowest.height) / scale));
      if (size.empty()) break;
      cv::resize(level_images_[level - 1], image, size, 0, 0, cv::INTER_LINEAR);
    }
    if (image.cols < kMinWidth || image.rows < kMinHeight) break;
    const cv::Rect2f area(kBorder, kBorder, static_cast<float>(image.cols - 2 * kBorder),
                          static_cast<float>(image.rows - 2 * kBorder));
    const std::vector<Corner> corners = SpreadKeypoints(DetectCorners(image), area, counts[level]);
    if (corners.empty()) continue;
    blurred_.create(image.size(), CV_8UC1);
    BlurGaussian7(View(image), blurred_.ptr<uint8_t>(), static_cast<std::ptrdiff_t>(blurred_.step));
    // Pixel centres are at integers, so levels are aligned at corners of pixels, not at centres.
    const double ratio_x = static_cast<double>(grey.cols) / image.cols,
                 ratio_y = static_cast<double>(grey.rows) / image.rows;
    for (const Corner& c : corners) {
      const Eigen::Vector2d pixel((c.x + double{c.dx} + 0.5) * ratio_x - 0.5,
                                  (c.y + double{c.dy} + 0.5) * ratio_y - 0.5);
      const std::optional<Eigen::Vector2d> ideal = ideal_image_.Undistort(pixel);
      if (!ideal) continue;
      const Moments moments =
          PatchMoments(image.ptr<uint8_t>(c.y) + c.x, static_cast<std::ptrdiff_t>(image.step));
      features.keypoints.push_back(
          {ideal->cast<float>(), AngleOf(moments), static_cast<uint8_t>(level)});
      features.descriptors.push_back(Describe(blurred_.ptr<uint8_t>(c.y) + c.x,
                                              static_cast<std::ptrdiff_t>(blurred_.step),
                                              DirectionOf(moments)));
    }
  }
  level_images_[0].release();
  features.BuildGrid();
  return features;
}

}  // namespace oaslam
