#include "oaslam/features/orb_extractor.h"

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "oaslam/features/keypoint_spread.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

constexpr int kPatchRadius = 15;  // of the orientation
constexpr int kBorder = 19;       // the rotated pattern reaches 13 * sqrt(2)
constexpr int kCellSize = 32;     // where a threshold is chosen

constexpr int kPattern[1024] = {
#include "oaslam/features/orb_pattern.inc"
};

// Pattern points as structure of arrays: 512 points, first and second of a pair alternating.
struct Pattern {
  std::array<float, 512> x, y;
  Pattern() {
    for (int i = 0; i < 512; ++i) {
      x[i] = static_cast<float>(kPattern[2 * i]);
      y[i] = static_cast<float>(kPattern[2 * i + 1]);
    }
  }
};

// Half width of the disc of kPatchRadius at each row.
std::array<int, kPatchRadius + 1> DiscHalfWidths() {
  std::array<int, kPatchRadius + 1> half{};
  for (int v = 0; v <= kPatchRadius; ++v)
    half[v] = static_cast<int>(std::lround(std::sqrt(kPatchRadius * kPatchRadius - v * v)));
  return half;
}

// Angle of the intensity centroid, [0, 2 pi).
float Orientation(const cv::Mat& image, int x, int y) {
  static const std::array<int, kPatchRadius + 1> half_width = DiscHalfWidths();
  const uchar* center = image.ptr<uchar>(y) + x;
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  int moment_x = 0, moment_y = 0;
  for (int u = -kPatchRadius; u <= kPatchRadius; ++u) moment_x += u * center[u];
  for (int v = 1; v <= kPatchRadius; ++v) {
    const uchar* below = center + v * step;
    const uchar* above = center - v * step;
    int row_difference = 0;
    for (int u = -half_width[v]; u <= half_width[v]; ++u) {
      row_difference += below[u] - above[u];
      moment_x += u * (below[u] + above[u]);
    }
    moment_y += v * row_difference;
  }
  const float angle = std::atan2(static_cast<float>(moment_y), static_cast<float>(moment_x));
  return angle < 0 ? angle + 2 * std::numbers::pi_v<float> : angle;
}

Descriptor Describe(const cv::Mat& blurred, int x, int y, float angle) {
  static const Pattern pattern;
  const float c = std::cos(angle), s = std::sin(angle);
  const int step = static_cast<int>(blurred.step);
  std::array<int, 512> offset;
  // Rounding by truncation of a positive number: vectorises without -ffast-math.
  for (int i = 0; i < 512; ++i) {
    const int u = static_cast<int>(pattern.x[i] * c - pattern.y[i] * s + 64.5F) - 64;
    const int v = static_cast<int>(pattern.x[i] * s + pattern.y[i] * c + 64.5F) - 64;
    offset[i] = v * step + u;
  }
  const uchar* center = blurred.ptr<uchar>(y) + x;
  Descriptor descriptor{};
  for (int word = 0; word < 4; ++word) {
    uint64_t bits = 0;
    const int* pair = offset.data() + word * 128;
    for (int bit = 0; bit < 64; ++bit)
      bits |= static_cast<uint64_t>(center[pair[2 * bit]] < center[pair[2 * bit + 1]]) << bit;
    descriptor[word] = bits;
  }
  return descriptor;
}

// FAST corners of one level: at the high threshold, and at the low one in cells where that finds nothing.
std::vector<cv::KeyPoint> DetectCorners(const cv::Mat& image, int threshold, int min_threshold) {
  constexpr int kRing = 3;  // FAST's circle: it finds nothing nearer to the border
  const cv::Rect inner(kBorder - kRing, kBorder - kRing, image.cols - 2 * (kBorder - kRing), image.rows - 2 * (kBorder - kRing));
  if (inner.width <= 2 * kRing || inner.height <= 2 * kRing) return {};
  std::vector<cv::KeyPoint> corners;
  cv::FAST(image(inner), corners, threshold, true);
  const int columns = (inner.width + kCellSize - 1) / kCellSize, rows = (inner.height + kCellSize - 1) / kCellSize;
  std::vector<char> filled(static_cast<size_t>(columns) * rows, 0);
  for (const cv::KeyPoint& k : corners)
    filled[static_cast<int>(k.pt.y) / kCellSize * columns + static_cast<int>(k.pt.x) / kCellSize] = 1;
  std::vector<cv::KeyPoint> weak;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      if (filled[row * columns + column]) continue;
      const cv::Rect cell = cv::Rect(column * kCellSize - kRing, row * kCellSize - kRing, kCellSize + 2 * kRing, kCellSize + 2 * kRing) &
                            cv::Rect({0, 0}, inner.size());
      cv::FAST(image(inner)(cell), weak, min_threshold, true);
      for (cv::KeyPoint& k : weak) {
        k.pt += cv::Point2f(cell.tl());
        corners.push_back(k);
      }
    }
  for (cv::KeyPoint& k : corners) k.pt += cv::Point2f(inner.tl());
  return corners;
}

}  // namespace

OrbExtractor::OrbExtractor(const FeaturesConfig& config, const Camera& camera)
    : config_(config), camera_(camera), pyramid_(config.levels, config.scale_factor), bounds_(IdealImageBounds(camera)) {}

std::vector<int> OrbExtractor::CountPerLevel(int count) const {
  // A geometric series: as many per area on each level.
  const double ratio = 1.0 / pyramid_.factor;
  double wanted = pyramid_.levels > 1 ? count * (1 - ratio) / (1 - std::pow(ratio, pyramid_.levels)) : count;
  std::vector<int> counts;
  int sum = 0;
  for (int level = 0; level + 1 < pyramid_.levels; ++level, wanted *= ratio) {
    counts.push_back(static_cast<int>(std::lround(wanted)));
    sum += counts.back();
  }
  counts.push_back(std::max(count - sum, 0));
  return counts;
}

Features OrbExtractor::Extract(const cv::Mat& grey, int count) const {
  OASLAM_CHECK(grey.type() == CV_8UC1 && grey.cols == camera_.width && grey.rows == camera_.height);
  Features features;
  features.pyramid = pyramid_;
  features.bounds = bounds_;
  const std::vector<int> counts = CountPerLevel(count);
  cv::Mat level_image = grey, blurred;
  for (int level = 0; level < pyramid_.levels; ++level) {
    const float scale = pyramid_.scale[level];
    if (level > 0) {
      cv::Mat smaller;
      const cv::Size size(cvRound(static_cast<float>(grey.cols) / scale), cvRound(static_cast<float>(grey.rows) / scale));
      cv::resize(level_image, smaller, size, 0, 0, cv::INTER_LINEAR);
      level_image = smaller;
    }
    if (level_image.cols <= 2 * kBorder + 8 || level_image.rows <= 2 * kBorder + 8) break;
    const cv::Rect2f area(kBorder, kBorder, static_cast<float>(level_image.cols - 2 * kBorder),
                          static_cast<float>(level_image.rows - 2 * kBorder));
    const auto corners = SpreadKeypoints(DetectCorners(level_image, config_.fast_threshold, config_.min_fast_threshold), area, counts[level]);
    if (corners.empty()) continue;
    cv::GaussianBlur(level_image, blurred, {7, 7}, 2, 2, cv::BORDER_REFLECT_101);
    // Pixel centres are at integers, so levels are aligned at corners of pixels, not at centres.
    const double ratio_x = static_cast<double>(grey.cols) / level_image.cols, ratio_y = static_cast<double>(grey.rows) / level_image.rows;
    for (const cv::KeyPoint& corner : corners) {
      const int x = cvRound(corner.pt.x), y = cvRound(corner.pt.y);
      const float angle = Orientation(level_image, x, y);
      const Eigen::Vector2d pixel((x + 0.5) * ratio_x - 0.5, (y + 0.5) * ratio_y - 0.5);
      features.keypoints.push_back({Undistort(camera_, pixel).cast<float>(), angle, static_cast<uint8_t>(level)});
      features.descriptors.push_back(Describe(blurred, x, y, angle));
    }
  }
  features.BuildGrid();
  return features;
}

}  // namespace oaslam
