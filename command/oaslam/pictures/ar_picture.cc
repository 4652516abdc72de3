#include "oaslam/pictures/ar_picture.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "oaslam/exports/map_scene.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/anchor.h"

namespace oaslam {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX, kShift = 4;  // 1 / 16 pixel
// Larger outlines and lines cannot be drawn well and are of no use.
constexpr double kMaxPixels = 1e5;

cv::Point FinePoint(const Eigen::Vector2d& px) {
  return {static_cast<int>(std::lround(px.x() * (1 << kShift))),
          static_cast<int>(std::lround(px.y() * (1 << kShift)))};
}

cv::Scalar ColorOf(int category_id) {
  const Rgb color = PaletteColor(static_cast<size_t>(std::max(category_id, 0)));
  const auto channel = [&](size_t i) {
    return color[i] + (255 - color[i]) * 0.3;  // lighter than on paper
  };
  return {channel(2), channel(1), channel(0)};
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
  if (!(axes.norm() < kMaxPixels) || !(ellipse.mean.norm() < kMaxPixels)) return;
  std::vector<cv::Point> points;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    const Eigen::Vector2d p =
        ellipse.mean + axes * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    points.push_back(FinePoint(p));
  }
  cv::polylines(picture, points, true, color, Thickness(scale), cv::LINE_AA, kShift);
}

void DrawText(const std::string& text, const cv::Point& baseline, double size,
              const cv::Scalar& color, cv::Mat& picture) {
  const int width = Thickness(size * 2);
  cv::putText(picture, text, baseline, kFont, size, cv::Scalar::all(20), width + 1, cv::LINE_AA);
  cv::putText(picture, text, baseline, kFont, size, color, width, cv::LINE_AA);
}

// The part of a segment in the camera's frame that is before the camera, if any.
void DrawSegment(const Camera& camera, Eigen::Vector3d a, Eigen::Vector3d b,
                 const cv::Scalar& color, double width, cv::Mat& picture) {
  constexpr double kNear = 0.02;  // of the depth of the farther end
  if (a.z() > b.z()) std::swap(a, b);
  if (!(b.z() > 0)) return;
  const double near = kNear * b.z();
  if (a.z() < near) a += (near - a.z()) / (b.z() - a.z()) * (b - a);
  const Eigen::Vector2d from = ProjectIdeal(camera, a), to = ProjectIdeal(camera, b);
  if (!(from.cwiseAbs().maxCoeff() < kMaxPixels) || !(to.cwiseAbs().maxCoeff() < kMaxPixels))
    return;
  cv::line(picture, FinePoint(from), FinePoint(to), color, Thickness(width), cv::LINE_AA, kShift);
}

// A name above a point of the picture.
struct NameTag {
  std::string text;
  Eigen::Vector2d at;
  cv::Scalar color;
  double depth;
};

void DrawNameTags(std::vector<NameTag> labels, cv::Mat& picture) {
  std::ranges::stable_sort(labels, {}, &NameTag::depth);
  const double scale = ScaleOf(picture), size = 0.4 * scale;
  const cv::Rect all({0, 0}, picture.size());
  std::vector<cv::Rect> taken;
  for (const NameTag& label : labels) {
    if (!(label.at.cwiseAbs().maxCoeff() < kMaxPixels)) continue;
    int below = 0;
    const cv::Size extent = cv::getTextSize(label.text, kFont, size, 1, &below);
    const cv::Point baseline(static_cast<int>(label.at.x() - extent.width / 2.0),
                             static_cast<int>(label.at.y() - 4 * scale));
    const cv::Rect place(baseline.x, baseline.y - extent.height, extent.width,
                         extent.height + below);
    if ((place & all) != place) continue;
    if (std::ranges::any_of(taken, [&](const cv::Rect& other) { return !(other & place).empty(); }))
      continue;
    taken.push_back(place);
    DrawText(label.text, baseline, size, label.color, picture);
  }
}

void DrawPath(const ArFrame& frame, cv::Mat& picture) {
  const cv::Scalar color(200, 170, 80);
  std::vector<std::pair<double, Eigen::Vector3d>> centers;  // by time, in the camera's frame
  frame.map->keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    centers.emplace_back(keyframe.timestamp,
                         *frame.cam_from_world * keyframe.cam_from_world.Inverse().translation);
  });
  std::ranges::stable_sort(centers, {}, &std::pair<double, Eigen::Vector3d>::first);
  for (size_t i = 1; i < centers.size(); ++i)
    DrawSegment(frame.camera, centers[i - 1].second, centers[i].second, color, ScaleOf(picture),
                picture);
}

void DrawObjects(const ArFrame& frame, const ClassNames& names, std::vector<NameTag>& labels,
                 cv::Mat& picture) {
  frame.map->objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    const auto ellipse = ProjectToEllipse(object.ellipsoid, *frame.cam_from_world, frame.camera);
    if (!ellipse) return;
    const Box box = BoundingBox(*ellipse);
    if (box.x2 < 0 || box.y2 < 0 || box.x1 > picture.cols || box.y1 > picture.rows) return;
    const cv::Scalar color = ColorOf(object.category_id);
    DrawEllipse(*ellipse, color, ScaleOf(picture), picture);
    labels.push_back({object.name.empty() ? NameOf(names, object.category_id) : object.name,
                      {ellipse->mean.x(), box.y1},
                      color,
                      (*frame.cam_from_world * object.ellipsoid.center).z()});
  });
}

void DrawAnchors(const ArFrame& frame, std::vector<NameTag>& labels, cv::Mat& picture) {
  const cv::Scalar colors[] = {{60, 60, 235}, {80, 205, 80}, {235, 130, 60}};  // of x, y, z
  const double width = 2 * ScaleOf(picture);
  for (const auto& [name, anchor] : frame.map->anchors) {
    const std::optional<Rigid3> world_from_anchor = WorldFromAnchor(*frame.map, anchor);
    if (!world_from_anchor || !(anchor.size > 0)) continue;
    const Rigid3 cam_from_anchor = *frame.cam_from_world * *world_from_anchor;
    const Eigen::Vector3d& foot = cam_from_anchor.translation;
    for (const int axis : {0, 2, 1}) {
      // The front and the side reach as far as content of the size would; the height is whole.
      const double length = axis == 1 ? anchor.size : anchor.size / 2;
      DrawSegment(frame.camera, foot, cam_from_anchor * (length * Eigen::Vector3d::Unit(axis)),
                  colors[axis], width, picture);
    }
    const Eigen::Vector3d top = cam_from_anchor * Eigen::Vector3d(0, anchor.size, 0);
    if (top.z() > 0)
      labels.push_back({name, ProjectIdeal(frame.camera, top), cv::Scalar::all(245), top.z()});
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

}  // namespace

void DrawArPicture(const ArFrame& frame, const ClassNames& names, cv::Mat& picture) {
  if (frame.cam_from_world && frame.map) {
    std::vector<NameTag> labels;
    DrawPath(frame, picture);
    DrawObjects(frame, names, labels, picture);
    DrawAnchors(frame, labels, picture);
    DrawNameTags(std::move(labels), picture);
  }
  DrawStatus(frame, picture);
}

void DrawBoxes(const std::vector<Detection>& detections, cv::Mat& picture) {
  constexpr double kPixelOfEdge = -0.5;  // a box is an area, and pixels are its centres
  const Eigen::Vector2d shift = Eigen::Vector2d::Constant(kPixelOfEdge);
  for (const Detection& detection : detections) {
    const Box& box = detection.box;
    if (!(std::max({-box.x1, -box.y1, box.x2, box.y2}) < kMaxPixels)) continue;
    cv::rectangle(picture, FinePoint(Eigen::Vector2d(box.x1, box.y1) + shift),
                  FinePoint(Eigen::Vector2d(box.x2, box.y2) + shift),
                  ColorOf(detection.category_id), Thickness(ScaleOf(picture)), cv::LINE_AA, kShift);
  }
}

}  // namespace oaslam
