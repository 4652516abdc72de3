#include "oaslam/content/overlay.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "oaslam/exports/svg.h"
#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX, kShift = 4;  // 1 / 16 pixel

cv::Scalar ColorOf(int category_id) {
  const std::string hex = PaletteColor(static_cast<size_t>(std::max(category_id, 0)));
  const auto channel = [&](size_t i) {
    const int value = std::stoi(hex.substr(i, 2), nullptr, 16);
    return value + (255 - value) * 0.3;  // lighter than on paper
  };
  return {channel(5), channel(3), channel(1)};
}

// The scale of text and lines: 1 in a picture of 640 x 480.
double ScaleOf(const cv::Mat& picture) {
  return std::max(0.5, std::min(picture.cols / 640.0, picture.rows / 480.0));
}

int Thickness(double width) { return std::max(1, static_cast<int>(std::lround(width))); }

void DrawEllipse(const Ellipse& ellipse, const cv::Scalar& color, double scale, cv::Mat& picture) {
  constexpr int kPoints = 96;  // of the outline: corners are not seen up to the size of the picture
  const Eigen::LLT<Eigen::Matrix2d> root(ellipse.covariance);
  if (root.info() != Eigen::Success) return;
  const Eigen::Matrix2d axes = root.matrixL();
  constexpr double kMaxPixels = 1e5;  // larger outlines cannot be drawn well and are of no use
  if (!(axes.norm() < kMaxPixels) || !(ellipse.mean.norm() < kMaxPixels)) return;
  std::vector<cv::Point> points;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    const Eigen::Vector2d p =
        ellipse.mean + axes * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    points.emplace_back(static_cast<int>(std::lround(p.x() * (1 << kShift))),
                        static_cast<int>(std::lround(p.y() * (1 << kShift))));
  }
  cv::polylines(picture, points, true, color, Thickness(scale), cv::LINE_AA, kShift);
}

void DrawText(const std::string& text, const cv::Point& baseline, double size,
              const cv::Scalar& color, cv::Mat& picture) {
  const int width = Thickness(size * 2);
  cv::putText(picture, text, baseline, kFont, size, cv::Scalar::all(20), width + 1, cv::LINE_AA);
  cv::putText(picture, text, baseline, kFont, size, color, width, cv::LINE_AA);
}

}  // namespace

void DrawOutlines(const ArFrame& frame, const ClassNames& names, cv::Mat& picture) {
  if (!frame.cam_from_world || !frame.map) return;
  struct Outline {
    const Object* object;
    Ellipse ellipse;
    double depth;
  };
  std::vector<Outline> outlines;
  frame.map->objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    if (const auto ellipse =
            ProjectToEllipse(object.ellipsoid, *frame.cam_from_world, frame.camera))
      outlines.push_back(
          {&object, *ellipse, (*frame.cam_from_world * object.ellipsoid.center).z()});
  });
  std::ranges::stable_sort(outlines, {}, &Outline::depth);
  const double scale = ScaleOf(picture), size = 0.4 * scale;
  const cv::Rect all({0, 0}, picture.size());
  std::vector<cv::Rect> taken;
  for (const Outline& o : outlines) {
    const Box box = BoundingBox(o.ellipse);
    if (box.x2 < 0 || box.y2 < 0 || box.x1 > picture.cols || box.y1 > picture.rows) continue;
    const cv::Scalar color = ColorOf(o.object->category_id);
    DrawEllipse(o.ellipse, color, scale, picture);
    const std::string text =
        o.object->name.empty() ? NameOf(names, o.object->category_id) : o.object->name;
    int below = 0;
    const cv::Size extent = cv::getTextSize(text, kFont, size, 1, &below);
    const double left = o.ellipse.mean.x() - extent.width / 2.0, bottom = box.y1 - 4 * scale;
    if (std::abs(left) > 1e6 || std::abs(bottom) > 1e6) continue;
    const cv::Point baseline(static_cast<int>(left), static_cast<int>(bottom));
    const cv::Rect place(baseline.x, baseline.y - extent.height, extent.width,
                         extent.height + below);
    if ((place & all) != place) continue;
    if (std::ranges::any_of(taken, [&](const cv::Rect& other) { return !(other & place).empty(); }))
      continue;
    taken.push_back(place);
    DrawText(text, baseline, size, color, picture);
  }
}

void DrawStatus(const ArFrame& frame, cv::Mat& picture) {
  const double scale = ScaleOf(picture), size = 0.42 * scale;
  const int height = std::min(picture.rows, static_cast<int>(std::lround(20 * scale)));
  cv::Mat strip = picture.rowRange(picture.rows - height, picture.rows);
  strip.convertTo(strip, -1, 0.45);
  std::string text = frame.state;
  if (frame.cam_from_world)
    text += fmt::format("   {} object{}   confidence {:.2f}", frame.objects,
                        frame.objects == 1 ? "" : "s", frame.confidence);
  DrawText(text, {static_cast<int>(8 * scale), picture.rows - static_cast<int>(6 * scale)}, size,
           cv::Scalar::all(235), picture);
}

}  // namespace oaslam
