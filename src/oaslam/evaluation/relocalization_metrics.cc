#include "oaslam/evaluation/relocalization_metrics.h"

#include <fmt/format.h>

#include <algorithm>

#include "oaslam/error.h"
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

}  // namespace oaslam
