#include "oaslam/evaluation/plots.h"

#include <fmt/format.h>

#include <algorithm>

#include "oaslam/io/svg.h"
#include "oaslam/io/text.h"
#include "oaslam/io/top_view.h"

namespace oaslam {
namespace {

constexpr const char* kTitleStyle = R"(fill="#111" font-weight="bold")";
constexpr const char* kReferenceStyle = R"(stroke="#111111" stroke-width="1.4" stroke-dasharray="6 4")";
constexpr const char* kEstimateStyle = R"(stroke="#1d4ed8" stroke-width="2" stroke-linejoin="round")";

void DrawPath(SvgCanvas& canvas, const PlaneView& view, const std::vector<Points2>& lines, const char* style) {
  for (Points2 line : lines) {
    std::ranges::transform(line, line.begin(), view);
    canvas.Polyline(line, style);
  }
}

}  // namespace

void SaveTrajectoryPlot(const std::string& path, const std::vector<StampedPose>& reference, const std::vector<StampedPose>& aligned_estimate,
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

void SaveRecallPlot(const std::string& path, const std::vector<RelocalizationErrors>& curves, const std::string& title) {
  const Eigen::Vector2d corner(64, 56), size(560, 380);
  const auto at = [&](double distance, double share) { return Eigen::Vector2d(corner.x() + size.x() * distance, corner.y() + size.y() * (1 - share)); };
  SvgCanvas canvas(corner.x() + size.x() + 32, corner.y() + size.y() + 70 + 22.0 * static_cast<double>(curves.size()));
  canvas.Text({24, 32}, title, 18, "start", kTitleStyle);
  for (int i = 0; i <= 10; ++i) {
    const double v = i / 10.0;
    canvas.Line(at(v, 0), at(v, 1), R"(stroke="#eeeeee")");
    canvas.Text(at(v, 0) + Eigen::Vector2d(0, 18), fmt::format("{}", 10 * i), 12, "middle");
    if (i % 2 != 0) continue;
    canvas.Line(at(0, v), at(1, v), R"(stroke="#eeeeee")");
    canvas.Text(at(0, v) + Eigen::Vector2d(-8, 4), fmt::format("{} %", 10 * i), 12, "end");
  }
  canvas.Rectangle(corner, size, R"(fill="none" stroke="#999999")");
  canvas.Text(at(0.5, 0) + Eigen::Vector2d(0, 40), fmt::format("position error [cm] (rotation within {:.0f} degrees)", kRecallMaxRotationDeg), 13, "middle");
  for (size_t i = 0; i < curves.size(); ++i) {
    Points2 line;
    for (int cm = 0; cm <= 100; ++cm) line.push_back(at(cm / 100.0, RecallAt(curves[i], cm / 100.0)));
    const std::string style = fmt::format(R"(stroke="{}" stroke-width="2.2" stroke-linejoin="round")", PaletteColor(i));
    canvas.Polyline(line, style);
    const double y = corner.y() + size.y() + 62 + 22.0 * static_cast<double>(i);
    canvas.Line({corner.x(), y}, {corner.x() + 30, y}, style);
    canvas.Text({corner.x() + 38, y + 4}, fmt::format("{} ({} frames)", curves[i].name, curves[i].frames), 13);
  }
  WriteTextFile(path, canvas.Finish());
}

}  // namespace oaslam
