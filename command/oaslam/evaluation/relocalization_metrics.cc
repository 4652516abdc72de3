#include "oaslam/evaluation/relocalization_metrics.h"

#include <fmt/format.h>

#include <algorithm>

#include "oaslam/evaluation/trajectory_metrics.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"

namespace oaslam {
namespace {

bool Counts(const PoseError& error, double distance) {
  return error.position <= distance && error.rotation_deg <= kRecallMaxRotationDeg;
}

double Share(size_t part, size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

RelocalizationErrors CompareRelocalization(const std::vector<StampedPose>& groundtruth_poses,
                                           const std::vector<StampedPose>& relocalized,
                                           const std::vector<double>& frame_times,
                                           const Alignment& groundtruth_from_map) {
  const auto groundtruth = WithoutDuplicates(groundtruth_poses),
             poses = WithoutDuplicates(relocalized);
  std::vector<StampedPose> frames;
  for (const double t : frame_times) frames.push_back({t, {}});
  RelocalizationErrors errors;
  errors.frames = Associate(groundtruth, frames).size();
  for (const auto& [r, q] : Associate(groundtruth, poses))
    errors.poses.push_back(ErrorOf(groundtruth[r], poses[q], groundtruth_from_map));
  return errors;
}

double RecallAt(const RelocalizationErrors& errors, double distance) {
  return Share(static_cast<size_t>(std::ranges::count_if(
                   errors.poses, [&](const PoseError& e) { return Counts(e, distance); })),
               errors.frames);
}

RelocalizationFigures Summarize(const RelocalizationErrors& errors) {
  RelocalizationFigures figures;
  for (size_t i = 0; i < kRecallDistances.size(); ++i) {
    figures.recall[i] = RecallAt(errors, kRecallDistances[i]);
    figures.precision[i] = errors.poses.empty()
                               ? 0
                               : figures.recall[i] * static_cast<double>(errors.frames) /
                                     static_cast<double>(errors.poses.size());
  }
  figures.accepted = Share(errors.poses.size(), errors.frames);
  std::vector<double> position, rotation;
  size_t wrong = 0;
  for (const PoseError& e : errors.poses) {
    wrong += e.position > kFalseDistance || e.rotation_deg > kFalseRotationDeg;
    position.push_back(e.position);
    rotation.push_back(e.rotation_deg);
  }
  figures.false_share = Share(wrong, errors.frames);
  figures.median_position = StatisticsOf(std::move(position)).median;
  figures.median_rotation_deg = StatisticsOf(std::move(rotation)).median;
  return figures;
}

std::vector<double> LoadFrameTimes(const std::string& path) {
  const std::string text = ReadTextFile(path);
  const auto lines = SplitLines(text);
  const bool is_table = !lines.empty() && lines[0].find(',') != std::string_view::npos;
  const size_t column = is_table ? ColumnOf(lines[0], {"timestamp"}, path) : 0;
  std::vector<double> times;
  for (size_t i = is_table ? 1 : 0; i < lines.size(); ++i) {
    const std::string_view line = Trim(lines[i]);
    if (line.empty() || line[0] == '#') continue;
    times.push_back(
        NumberAt(is_table ? SplitCommas(line) : SplitFields(line), column, path, i + 1));
  }
  std::ranges::sort(times);
  return times;
}

std::vector<HypothesisError> CompareHypotheses(
    const std::vector<StampedPose>& groundtruth, const std::vector<ScoredPose>& hypotheses,
    const std::vector<std::pair<double, double>>& confidences,
    const Alignment& groundtruth_from_map) {
  std::vector<StampedPose> best;
  for (const ScoredPose& hypothesis : hypotheses)
    if (best.empty() || best.back().timestamp != hypothesis.pose.timestamp)
      best.push_back(hypothesis.pose);
  const auto truth = WithoutDuplicates(groundtruth);
  std::vector<HypothesisError> errors;
  for (const auto& [reference, query] : Associate(truth, best)) {
    const auto frame = std::ranges::lower_bound(confidences, best[query].timestamp - 1e-6, {},
                                                &std::pair<double, double>::first);
    if (frame == confidences.end() || frame->first > best[query].timestamp + 1e-6) continue;
    errors.push_back({frame->second, ErrorOf(truth[reference], best[query], groundtruth_from_map)});
  }
  return errors;
}

void SaveHypothesisErrors(const std::string& path, std::span<const HypothesisError> hypotheses) {
  std::string text = "timestamp,confidence,position_error_m,rotation_error_deg\n";
  for (const HypothesisError& h : hypotheses)
    text += fmt::format("{:.6f},{:.4f},{:.6g},{:.4f}\n", h.error.timestamp, h.confidence,
                        h.error.position, h.error.rotation_deg);
  WriteTextFile(path, text);
}

}  // namespace oaslam
