#include "oaslam/features/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "oaslam/features/keypoint_spread.h"
#include "oaslam/features/resize.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

constexpr int kBorder = kPatternReach;
constexpr int kFastBorder = kBorder - kFastRing;  // margin around FAST's own border
// Side of the cells in which a threshold is chosen: smaller ones follow the contrast more closely,
// but take noise for corners in each that has no texture.
constexpr int kCellSize = 32;
// Least contrast of a corner in grey levels, since weaker ones are often noise; and where a cell
// has no such corner, so that dim parts of an image are used.
constexpr uint8_t kContrast = 20, kMinContrast = 7;
// Levels of the pyramid and the scale between them: they cover a change of distance by 3.6.
constexpr int kLevels = 8;
constexpr double kScaleFactor = 1.2;

// atan2 of integers is that of doubles. That of floats gives other bits on other processors.
float AngleOf(const Moments& moments) {
  const auto angle = static_cast<float>(std::atan2(moments.y, moments.x));
  return angle < 0 ? angle + 2 * std::numbers::pi_v<float> : angle;
}

int Rounded(double value) { return static_cast<int>(std::lrint(value)); }

// How many times smaller than the image of the camera is that in which key points are detected. It
// has as many pixels as `resolution` x 3/4 `resolution`, whatever the image's shape. Scaling blurs,
// so that the size is kept where it would change by less than a fifth. An image of less than half
// the size is enlarged, so that FAST's circle of 7 pixels fits its details; by 2 at most, since
// details beyond are invented.
double WorkingShrink(const Camera& camera, int resolution) {
  constexpr double kWorthwhile = 1.2, kSmall = 0.5, kMaxEnlargement = 2;
  const double area = static_cast<double>(camera.width) * camera.height;
  const double shrink = std::sqrt(area / (0.75 * resolution * resolution));
  if (shrink < kSmall / kWorthwhile) return std::max(shrink / kSmall, 1 / kMaxEnlargement);
  return shrink < kWorthwhile ? 1 : shrink;
}

}  // namespace

OrbExtractor::OrbExtractor(const FeaturesConfig& config, const Camera& camera)
    : config_(config), camera_(camera), ideal_image_(camera) {
  constexpr int kMinWidth = kMinKernelWidth + 2 * kFastBorder, kMinHeight = 2 * kBorder + 9;
  const double shrink = WorkingShrink(camera, config.resolution);
  const int lowest_width = std::max(1, Rounded(camera.width / shrink)),
            lowest_height = std::max(1, Rounded(camera.height / shrink));
  pyramid_ = PyramidScales(kLevels, kScaleFactor,
                           std::sqrt(static_cast<double>(camera.width) * camera.height /
                                     (static_cast<double>(lowest_width) * lowest_height)));
  for (int level = 0; level < pyramid_.levels; ++level) {
    const int width = Rounded(lowest_width / pyramid_.Relative(level)),
              height = Rounded(lowest_height / pyramid_.Relative(level));
    if (width < kMinWidth || height < kMinHeight) break;
    levels_.emplace_back(width, height);
  }
  if (!levels_.empty()) blurred_ = GreyBuffer(lowest_width, lowest_height);
}

void OrbExtractor::UseCamera(const Camera& camera, double zoom) {
  camera_ = camera;
  ideal_image_ = IdealImage(camera);
  pyramid_.zoom = zoom;
}

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
std::vector<Corner> OrbExtractor::DetectCorners(const GreyImage& image) {
  const GreyImage inner = image.Inside(kFastBorder);
  std::vector<Corner> corners = DetectFast(inner, kMinContrast, scores_);
  const int columns = inner.width / kCellSize + 1;
  const auto cell_of = [&](const Corner& c) { return c.y / kCellSize * columns + c.x / kCellSize; };
  std::vector<char> is_strong(static_cast<size_t>(columns) * (inner.height / kCellSize + 1), 0);
  for (const Corner& c : corners)
    if (c.score > kContrast) is_strong[cell_of(c)] = 1;
  std::erase_if(corners,
                [&](const Corner& c) { return c.score <= kContrast && is_strong[cell_of(c)]; });
  for (Corner& c : corners) {
    c.x += kFastBorder;
    c.y += kFastBorder;
  }
  const auto is_hidden = [&](int x, int y) {
    return mask_.Hides((x + 0.5) / image.width, (y + 0.5) / image.height);
  };
  constexpr int kReach = kBorder / 2;  // most of the patch that is described
  std::erase_if(corners, [&](const Corner& c) {
    return is_hidden(c.x, c.y) || is_hidden(c.x - kReach, c.y) || is_hidden(c.x + kReach, c.y) ||
           is_hidden(c.x, c.y - kReach) || is_hidden(c.x, c.y + kReach);
  });
  return corners;
}

Features OrbExtractor::Nothing() const {
  Features features;
  features.pyramid = pyramid_;
  features.bounds = ideal_image_.bounds();
  return features;
}

GreyBuffer OrbExtractor::WorkingImage(const GreyImage& image) const {
  const bool is_scaled = !levels_.empty() && (levels_.front().width() != image.width ||
                                              levels_.front().height() != image.height);
  if (is_scaled) return levels_.front();
  GreyBuffer copy(image.width, image.height);
  for (int y = 0; y < image.height; ++y) std::copy_n(image.Row(y), image.width, copy.Row(y));
  return copy;
}

Features OrbExtractor::Extract(const GreyImage& image, int count) {
  OASLAM_CHECK(image.width == camera_.width && image.height == camera_.height);
  Features features = Nothing();
  const std::vector<int> counts = CountPerLevel(count);
  GreyImage level = image;
  for (size_t i = 0; i < levels_.size(); ++i) {
    GreyBuffer& scaled = levels_[i];
    if (level.width != scaled.width() || level.height != scaled.height()) {
      if (i > 0)
        ResizeLinear(level, scaled);
      else if (scaled.width() < level.width)
        ResizeByArea(level, scaled);
      else
        ResizeCubic(level, scaled);
      level = scaled.view();
    }
    const Box area{kBorder, kBorder, static_cast<double>(level.width - kBorder),
                   static_cast<double>(level.height - kBorder)};
    const std::vector<Corner> corners = SpreadKeypoints(DetectCorners(level), area, counts[i]);
    if (corners.empty()) continue;
    BlurGaussian7(level, blurred_.Row(0), blurred_.step());
    // Pixel centres are at integers, so levels are aligned at corners of pixels, not at centres.
    const double ratio_x = static_cast<double>(image.width) / level.width,
                 ratio_y = static_cast<double>(image.height) / level.height;
    for (const Corner& c : corners) {
      const Eigen::Vector2d pixel((c.x + double{c.dx} + 0.5) * ratio_x - 0.5,
                                  (c.y + double{c.dy} + 0.5) * ratio_y - 0.5);
      const std::optional<Eigen::Vector2d> ideal = ideal_image_.Undistort(pixel);
      if (!ideal) continue;
      const Moments moments = PatchMoments(level.Row(c.y) + c.x, level.step);
      features.keypoints.push_back(
          {ideal->cast<float>(), AngleOf(moments), static_cast<uint8_t>(i)});
      features.descriptors.push_back(
          Describe(blurred_.Row(c.y) + c.x, blurred_.step(), DirectionOf(moments)));
    }
  }
  features.BuildGrid();
  return features;
}

}  // namespace oaslam
