#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "oaslam/formats/text.h"
#include "oaslam/geometry/ellipse.h"
#include "oaslam/pictures/map_results.h"
#include "oaslam/pictures/svg.h"
#include "oaslam/pictures/top_view.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// The layout, in pixels: it fits a page of a document and a screen of 1080 lines.
constexpr double kWidth = 1080, kMargin = 24, kTop = 52, kLegendWidth = 190, kMaxHeight = 780;
constexpr double kLabelSize = 12;
constexpr size_t kMaxDots = 20000;  // gives a file of about 300 kB

constexpr const char* kTrajectoryStyle =
    R"(stroke="#1d4ed8" stroke-width="2.2" stroke-linejoin="round" stroke-linecap="round")";
constexpr const char* kGroundtruthStyle =
    R"(stroke="#111111" stroke-width="1.4" stroke-dasharray="6 4")";
constexpr const char* kHeadingStyle =
    R"(fill="#f97316" fill-opacity="0.85" stroke="white" stroke-width="0.5")";
constexpr const char* kKeyframeStyle = R"(fill="white" stroke="#1d4ed8" stroke-width="1.2")";
constexpr const char* kDotColor = "#b4b8bf";

// The outline of an ellipsoid seen from above: the ellipse x^T S^-1 x = 1 with S the projected
// shape matrix.
struct TopEllipse {
  int category_id = 0;
  Eigen::Vector2d center = Eigen::Vector2d::Zero(), radii = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_extent = Eigen::Vector2d::Zero();  // of its bounding rectangle
  double angle_rad = 0;  // of radii.x, counterclockwise seen from above
};

std::vector<TopEllipse> ProjectObjects(const Map& map, const TopAxes& axes) {
  std::vector<TopEllipse> ellipses;
  Eigen::Matrix<double, 2, 3> basis;
  basis << axes.right.transpose(), axes.forward.transpose();
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    const Eigen::Matrix<double, 2, 3> half = basis * object.ellipsoid.rotation.toRotationMatrix() *
                                             object.ellipsoid.half_axes.asDiagonal();
    const Eigen::Matrix2d shape = half * half.transpose();
    const PrincipalAxes principal = PrincipalAxesOf(shape);
    ellipses.push_back({object.category_id,
                        axes(object.ellipsoid.center),
                        {principal.major, principal.minor},
                        shape.diagonal().cwiseSqrt(),
                        principal.angle_rad});
  });
  return ellipses;
}

std::vector<Rigid3> CameraPoses(const MapPlot& plot) {
  std::vector<Rigid3> poses;
  plot.map->keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    poses.push_back(keyframe.cam_from_world.Inverse());
  });
  if (poses.empty())
    for (const StampedPose& pose : plot.trajectory) poses.push_back(pose.world_from_cam);
  if (poses.empty())
    for (const StampedPose& pose : plot.localized) poses.push_back(pose.world_from_cam);
  return poses;
}

// The extent always includes the cameras; objects, localized poses and points only if they are not
// far away, since one wrong point would make the map a dot. The bounds are by eye, as shares of the
// side.
Extent ShownExtent(const Points2& cameras, const Points2& localized, const Points2& landmarks,
                   const std::vector<TopEllipse>& objects) {
  Extent path;
  for (const auto& p : cameras) path.Add(p);
  Extent objects_extent;
  for (const TopEllipse& e : objects) {
    objects_extent.Add(Eigen::Vector2d(e.center - e.half_extent));
    objects_extent.Add(Eigen::Vector2d(e.center + e.half_extent));
  }
  Extent core = path;
  core.Add(path.IsEmpty() ? objects_extent : objects_extent.Within(path.Grown(3 * path.Side())));
  if (core.IsEmpty()) core = QuantileExtent(landmarks, 0.1);
  const Extent bounds = core.Grown(0.3 * core.Side());
  Extent shown = core;
  shown.Add(QuantileExtent(localized, 0.02).Within(bounds));
  shown.Add(QuantileExtent(landmarks, 0.05).Within(bounds));
  return shown.Grown(0.04 * shown.Side());
}

// Places labels one after another, each where it covers least: in its ellipse or on five rings of
// twelve places about it. To cover another label, or to leave the picture, is worse than to cover
// part of an ellipse, and that is worse than to be one ring (40 square pixels) farther out.
class LabelPlacer {
 public:
  explicit LabelPlacer(const PlaneView& view) : view_(view) {}

  void Block(const Eigen::Vector2d& center, const Eigen::Vector2d& half) {
    ellipses_.push_back({center - half, center + half});
  }

  void Place(SvgCanvas& canvas, const std::string& text, const Eigen::Vector2d& center,
             const Eigen::Vector2d& half, const std::string& color) {
    const Eigen::Vector2d box(TextWidth(text, kLabelSize) / 2 + 2, kLabelSize / 2 + 1);
    Eigen::Vector2d best = center;
    double least = 1e300;
    const bool fits_inside = (half - box).minCoeff() > 0;
    for (int ring = fits_inside ? 0 : 1; ring < 6; ++ring) {
      for (int step = 0; step < (ring == 0 ? 1 : 12); ++step) {
        const double angle = (step % 2 == 0 ? 1 : -1) * ((step + 1) / 2) * std::numbers::pi / 6 -
                             std::numbers::pi / 2;
        const Eigen::Vector2d reach =
            ring == 0 ? Eigen::Vector2d::Zero()
                      : Eigen::Vector2d((half + box).array() + 2 + 14 * (ring - 1));
        const Eigen::Vector2d at =
            center + Eigen::Vector2d(std::cos(angle), std::sin(angle)).cwiseProduct(reach);
        const double cost = Cost(at, box) + 40.0 * ring;
        if (cost < least) least = cost, best = at;
      }
    }
    labels_.push_back({best - box, best + box});
    if (((best - center).cwiseAbs() - half - box).maxCoeff() > 8)
      canvas.Line(center, best,
                  fmt::format(R"(stroke="{}" stroke-width="0.8" stroke-opacity="0.7")", color));
    canvas.Text(
        best + Eigen::Vector2d(0, 0.36 * kLabelSize), text, kLabelSize, "middle",
        fmt::format(
            R"(fill="{}" stroke="white" stroke-width="3" stroke-opacity="0.85" paint-order="stroke" stroke-linejoin="round" font-weight="bold")",
            color));
  }

 private:
  static double Overlap(const Extent& a, const Extent& b) {
    const Eigen::Vector2d side = a.high.cwiseMin(b.high) - a.low.cwiseMax(b.low);
    return side.minCoeff() > 0 ? side.prod() : 0;
  }
  double Cost(const Eigen::Vector2d& at, const Eigen::Vector2d& box) const {
    const Extent label{at - box, at + box};
    double cost = 0;
    for (const Extent& other : labels_) cost += 10 * Overlap(label, other);
    for (const Extent& other : ellipses_)
      if (!((other.low - label.low).maxCoeff() < 0 && (label.high - other.high).maxCoeff() < 0))
        cost += 0.6 * Overlap(label, other);
    const Extent inside = label.Within({view_.corner(), view_.corner() + view_.size()});
    return cost + 20 * ((label.high - label.low).prod() - (inside.high - inside.low).prod());
  }

  const PlaneView& view_;
  std::vector<Extent> labels_, ellipses_;
};

void DrawObjects(SvgCanvas& canvas, const PlaneView& view, std::vector<TopEllipse> objects,
                 const ClassNames& names, const std::map<int, std::string>& colors) {
  // Large ones first, so that small ones on them stay visible.
  std::ranges::stable_sort(objects, std::greater<>(),
                           [](const TopEllipse& e) { return e.radii.prod(); });
  LabelPlacer placer(view);
  for (const TopEllipse& e : objects) {
    const std::string& color = colors.at(e.category_id);
    canvas.Ellipse(
        view(e.center), e.radii * view.scale(), -e.angle_rad * 180 / std::numbers::pi,
        fmt::format(R"(fill="{0}" fill-opacity="0.18" stroke="{0}" stroke-width="1.8")", color));
    placer.Block(view(e.center), e.half_extent * view.scale());
  }
  for (const TopEllipse& e : objects)
    placer.Place(canvas, NameOf(names, e.category_id), view(e.center), e.half_extent * view.scale(),
                 colors.at(e.category_id));
}

void DrawPoses(SvgCanvas& canvas, const PlaneView& view, const MapPlot& plot, const TopAxes& axes) {
  const auto lines = [&](const std::vector<StampedPose>& poses, const char* style) {
    for (Points2 line : TopLines(poses, axes)) {
      std::ranges::transform(line, line.begin(), view);
      canvas.Polyline(line, style);
    }
  };
  lines(plot.groundtruth, kGroundtruthStyle);
  lines(plot.trajectory, kTrajectoryStyle);
  plot.map->keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    canvas.Circle(view(axes(keyframe.cam_from_world.OriginInSource())), 2.2, kKeyframeStyle);
  });
  for (const StampedPose& pose : plot.localized) {
    const Eigen::Vector2d at = view(axes(pose.world_from_cam.translation));
    Eigen::Vector2d heading = axes(pose.world_from_cam.rotation * Eigen::Vector3d::UnitZ());
    heading.y() *= -1;
    if (heading.norm() < 0.05) {
      canvas.Circle(at, 3, kHeadingStyle);  // the camera looks straight down
      continue;
    }
    heading.normalize();
    const Eigen::Vector2d side(-heading.y(), heading.x());
    canvas.Polygon({at + 8 * heading, at - 4 * heading + 4 * side, at - 4 * heading - 4 * side},
                   kHeadingStyle);
  }
}

void DrawLegend(SvgCanvas& canvas, const Eigen::Vector2d& corner, const MapPlot& plot,
                const std::vector<TopEllipse>& objects, const std::map<int, std::string>& colors) {
  double y = corner.y() + 10;
  const auto entry = [&](const std::string& text) {
    canvas.Text({corner.x() + 34, y + 4}, text, 12.5);
    y += 22;
  };
  const auto sample = [&](double dx) { return Eigen::Vector2d(corner.x() + dx, y); };
  if (!plot.trajectory.empty()) {
    canvas.Line(sample(0), sample(26), kTrajectoryStyle);
    entry("trajectory");
  }
  if (!plot.map->keyframes.empty()) {
    canvas.Circle(sample(13), 3, kKeyframeStyle);
    entry(fmt::format("{} keyframes", plot.map->keyframes.size()));
  }
  if (!plot.groundtruth.empty()) {
    canvas.Line(sample(0), sample(26), kGroundtruthStyle);
    entry("ground truth");
  }
  if (!plot.localized.empty()) {
    canvas.Polygon(
        {sample(21), sample(9) + Eigen::Vector2d(0, 4), sample(9) - Eigen::Vector2d(0, 4)},
        kHeadingStyle);
    entry(fmt::format("{} localized", plot.localized.size()));
  }
  if (!plot.map->landmarks.empty()) {
    canvas.Dots({sample(6), sample(13), sample(20)}, 3, kDotColor);
    entry(fmt::format("{} landmarks", plot.map->landmarks.size()));
  }
  if (objects.empty()) return;
  y += 8;
  canvas.Text({corner.x(), y + 4}, fmt::format("{} objects", objects.size()), 12.5, "start",
              R"(fill="#333" font-weight="bold")");
  y += 22;
  for (const auto& [category, color] : colors) {
    canvas.Ellipse(
        sample(13), {10, 6}, 0,
        fmt::format(R"(fill="{0}" fill-opacity="0.18" stroke="{0}" stroke-width="1.8")", color));
    const auto count = std::ranges::count(objects, category, &TopEllipse::category_id);
    entry(count > 1 ? fmt::format("{} ({})", NameOf(plot.names, category), count)
                    : NameOf(plot.names, category));
  }
}

}  // namespace

void SaveMapSvg(const std::string& path, const MapPlot& plot) {
  OASLAM_CHECK(plot.map != nullptr);
  const TopAxes axes = FindTopAxes(CameraPoses(plot), plot.map->up);
  const std::vector<TopEllipse> objects = ProjectObjects(*plot.map, axes);
  Points2 cameras, localized, landmarks;
  plot.map->keyframes.ForEach([&](KeyframeId, const Keyframe& k) {
    cameras.push_back(axes(k.cam_from_world.OriginInSource()));
  });
  for (const auto* poses : {&plot.trajectory, &plot.groundtruth})
    for (const StampedPose& pose : *poses) cameras.push_back(axes(pose.world_from_cam.translation));
  for (const StampedPose& pose : plot.localized)
    localized.push_back(axes(pose.world_from_cam.translation));
  plot.map->landmarks.ForEach(
      [&](LandmarkId, const Landmark& landmark) { landmarks.push_back(axes(landmark.position)); });

  const PlaneView view(ShownExtent(cameras, localized, landmarks, objects), {kMargin, kTop},
                       {kWidth - 3 * kMargin - kLegendWidth, kMaxHeight});
  std::map<int, std::string> colors;
  for (const TopEllipse& e : objects) colors[e.category_id];
  size_t next = 0;
  for (auto& [category, color] : colors) color = HexOf(PaletteColor(next++));
  const double legend_height = 22.0 * static_cast<double>(colors.size() + 7);
  SvgCanvas canvas(kWidth, kTop + std::max(view.size().y(), legend_height) + kMargin);
  canvas.Text({kMargin, 34}, plot.title.empty() ? "Map from above" : plot.title, 20, "start",
              R"(fill="#111" font-weight="bold")");

  const double step = RoundStep(view.size().x() / view.scale() / 5);
  view.DrawGrid(canvas, step);
  canvas.BeginClip(view.corner(), view.size());
  Points2 dots;
  const size_t stride = landmarks.size() / kMaxDots + 1;
  for (size_t i = 0; i < landmarks.size(); i += stride) {
    const Eigen::Vector2d p = view(landmarks[i]) - view.corner();
    if (p.minCoeff() > 0 && (view.size() - p).minCoeff() > 0) dots.push_back(p + view.corner());
  }
  canvas.Dots(dots, 2, kDotColor);
  DrawPoses(canvas, view, plot, axes);
  DrawObjects(canvas, view, objects, plot.names, colors);
  canvas.EndClip();
  const char* unit = plot.map->is_metric ? "m" : step == 1 ? "map unit" : "map units";
  view.DrawScaleBar(canvas, step, plot.map->keyframes.empty() ? "" : unit);
  DrawLegend(canvas, {kWidth - kMargin - kLegendWidth, kTop}, plot, objects, colors);
  WriteTextFile(path, canvas.Finish());
}

}  // namespace oaslam
