#include "oaslam/evaluation/plots.h"

#include <fmt/format.h>

#include <algorithm>

#include "oaslam/formats/text.h"
#include "oaslam/pictures/svg.h"
#include "oaslam/pictures/top_view.h"

namespace oaslam {
namespace {

constexpr const char* kTitleStyle = R"(fill="#111" font-weight="bold")";
constexpr const char* kReferenceStyle =
    R"(stroke="#111111" stroke-width="1.4" stroke-dasharray="6 4")";
constexpr const char* kEstimateStyle =
    R"(stroke="#1d4ed8" stroke-width="2" stroke-linejoin="round")";

void DrawPath(SvgCanvas& canvas, const PlaneView& view, const std::vector<Points2>& lines,
              const char* style) {
  for (Points2 line : lines) {
    std::ranges::transform(line, line.begin(), view);
    canvas.Polyline(line, style);
  }
}

// A chart of lines over two axes that begin at zero, with a legend below.
class Chart {
 public:
  Chart(double width, double height, const std::string& title, size_t curves)
      : units_(width, height),
        canvas_(kCorner.x() + kSize.x() + 32,
                kCorner.y() + kSize.y() + 70 + kRow * static_cast<double>(curves)) {
    canvas_.Text({24, 32}, title, 18, "start", kTitleStyle);
  }

  void DrawGrid(const std::string& x_label, const std::string& y_unit) {
    const double dx = RoundStep(units_.x() / 7), dy = RoundStep(units_.y() / 4);
    for (int i = 0; i * dx <= units_.x() * (1 + 1e-9); ++i) {
      canvas_.Line(At({i * dx, 0}), At({i * dx, units_.y()}), kGridStyle);
      canvas_.Text(At({i * dx, 0}) + Eigen::Vector2d(0, 18), fmt::format("{:g}", i * dx), 12,
                   "middle");
    }
    for (int i = 0; i * dy <= units_.y() * (1 + 1e-9); ++i) {
      canvas_.Line(At({0, i * dy}), At({units_.x(), i * dy}), kGridStyle);
      canvas_.Text(At({0, i * dy}) + Eigen::Vector2d(-8, 4), fmt::format("{:g} {}", i * dy, y_unit),
                   12, "end");
    }
    canvas_.Rectangle(kCorner, kSize, R"(fill="none" stroke="#999999")");
    canvas_.Text(At({units_.x() / 2, 0}) + Eigen::Vector2d(0, 40), x_label, 13, "middle");
  }

  void Add(const std::string& name, Points2 line) {
    std::ranges::transform(line, line.begin(), [&](const Eigen::Vector2d& p) { return At(p); });
    const std::string style = fmt::format(
        R"(stroke="{}" stroke-width="2.2" stroke-linejoin="round")", HexOf(PaletteColor(count_)));
    canvas_.Polyline(line, style);
    const double y = kCorner.y() + kSize.y() + 62 + kRow * static_cast<double>(count_++);
    canvas_.Line({kCorner.x(), y}, {kCorner.x() + 30, y}, style);
    canvas_.Text({kCorner.x() + 38, y + 4}, name, 13);
  }

  std::string Finish() const { return canvas_.Finish(); }

 private:
  static constexpr double kRow = 22;
  static constexpr const char* kGridStyle = R"(stroke="#eeeeee")";
  inline static const Eigen::Vector2d kCorner{64, 56}, kSize{560, 380};

  Eigen::Vector2d At(const Eigen::Vector2d& p) const {
    return kCorner +
           Eigen::Vector2d(kSize.x() * p.x() / units_.x(), kSize.y() * (1 - p.y() / units_.y()));
  }

  Eigen::Vector2d units_;
  SvgCanvas canvas_;
  size_t count_ = 0;
};

}  // namespace

void SaveTrajectoryPlot(const std::string& path, const std::vector<StampedPose>& reference,
                        const std::vector<StampedPose>& aligned_estimate,
                        const std::string& title) {
  std::vector<Rigid3> poses;
  for (const StampedPose& pose : reference) poses.push_back(pose.world_from_cam);
  const TopAxes axes = FindTopAxes(poses, std::nullopt);
  Extent extent;
  for (const auto* trajectory : {&reference, &aligned_estimate})
    for (const StampedPose& pose : *trajectory) extent.Add(axes(pose.world_from_cam.translation));
  const PlaneView view(extent.Grown(0.05 * extent.Side()), {24, 52}, {720, 640});
  SvgCanvas canvas(768, 52 + view.size().y() + 48);
  canvas.Text({24, 34}, title, 18, "start", kTitleStyle);
  const double step = RoundStep(view.size().x() / view.scale() / 5);
  view.DrawGrid(canvas, step);
  DrawPath(canvas, view, TopLines(reference, axes), kReferenceStyle);
  DrawPath(canvas, view, TopLines(aligned_estimate, axes), kEstimateStyle);
  view.DrawScaleBar(canvas, step, "m");
  const double y = 52 + view.size().y() + 26;
  canvas.Line({24, y}, {54, y}, kReferenceStyle);
  canvas.Text({62, y + 4}, "ground truth", 13);
  canvas.Line({174, y}, {204, y}, kEstimateStyle);
  canvas.Text({212, y + 4}, "estimate", 13);
  WriteTextFile(path, canvas.Finish());
}

void SaveRecallPlot(const std::string& path, const std::vector<RelocalizationErrors>& curves,
                    const std::string& title) {
  Chart chart(100, 100, title, curves.size());
  chart.DrawGrid(
      fmt::format("position error [cm] (rotation within {:.0f} degrees)", kRecallMaxRotationDeg),
      "%");
  for (const RelocalizationErrors& curve : curves) {
    Points2 line;
    for (int cm = 0; cm <= 100; ++cm)
      line.push_back({static_cast<double>(cm), 100 * RecallAt(curve, cm / 100.0)});
    chart.Add(fmt::format("{} ({} frames)", curve.name, curve.frames), line);
  }
  WriteTextFile(path, chart.Finish());
}

}  // namespace oaslam
