#include "oaslam/trajectory_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "oaslam/error.h"
#include "oaslam/formats/text.h"

namespace oaslam {
namespace {

// The numbers of a line that is no comment, `count` or more of them, and the number of the line.
struct NumberedRow {
  int line = 0;
  std::vector<double> values;
};

std::vector<NumberedRow> ReadRows(const std::string& path, size_t count) {
  const std::string text = ReadTextFile(path);
  std::vector<NumberedRow> rows;
  int line_number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++line_number;
    const std::string_view trimmed = Trim(line);
    if (trimmed.empty() || trimmed[0] == '#') continue;
    const auto fields = SplitFields(trimmed);
    if (fields.size() < count)
      throw InputError(
          fmt::format("{}:{}: {} columns, expected {}", path, line_number, fields.size(), count));
    NumberedRow row{line_number, {}};
    for (size_t i = 0; i < count; ++i) {
      const auto value = ParseNumber(fields[i]);
      if (!value)
        throw InputError(
            fmt::format("{}:{}: \"{}\", expected a number", path, line_number, fields[i]));
      row.values.push_back(*value);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

StampedPose PoseOf(const NumberedRow& row, const std::string& path) {
  const auto& v = row.values;
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  if (std::abs(rotation.norm() - 1) > 0.1)  // files of other tools may be rounded
    throw InputError(fmt::format("{}:{}: quaternion of length {:.3g}, expected 1", path, row.line,
                                 rotation.norm()));
  return {v[0], Rigid3(rotation.normalized(), Eigen::Vector3d(v[1], v[2], v[3]))};
}

bool IsFinite(const StampedPose& pose) {
  return std::isfinite(pose.timestamp) && pose.world_from_cam.translation.allFinite() &&
         Eigen::Quaterniond(pose.world_from_cam.rotation).coeffs().allFinite();
}

void AppendPose(std::string& text, const StampedPose& pose) {
  // The sign of the quaternion is fixed and "-0" avoided, so that equal poses give equal bytes.
  Eigen::Quaterniond q = pose.world_from_cam.rotation;
  if (q.w() < 0) q.coeffs() *= -1;
  const Eigen::Vector3d& t = pose.world_from_cam.translation;
  const auto clean = [](double value) { return std::abs(value) < 5e-10 ? 0.0 : value; };
  fmt::format_to(std::back_inserter(text), "{:.6f}", pose.timestamp);
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()})
    fmt::format_to(std::back_inserter(text), " {:.9f}", clean(value));
}

}  // namespace

std::vector<StampedPose> LoadTrajectory(const std::string& path) {
  std::vector<StampedPose> poses;
  for (const NumberedRow& row : ReadRows(path, 8)) poses.push_back(PoseOf(row, path));
  std::ranges::stable_sort(poses, {}, &StampedPose::timestamp);
  return poses;
}

void SaveTrajectory(const std::string& path, const std::vector<StampedPose>& poses) {
  std::string text;
  for (size_t i = 0; i < poses.size(); ++i)
    if (!IsFinite(poses[i]))
      throw InputError(fmt::format("{}: pose {} has a number that is not finite", path, i));
  for (const StampedPose& pose : poses) {
    AppendPose(text, pose);
    text += '\n';
  }
  WriteTextFile(path, text);
}

void SaveScoredPoses(const std::string& path, const std::vector<ScoredPose>& poses) {
  std::string text;
  for (const ScoredPose& scored : poses) {
    AppendPose(text, scored.pose);
    fmt::format_to(std::back_inserter(text), " {:.6f}\n", scored.score);
  }
  WriteTextFile(path, text);
}

std::vector<ScoredPose> LoadScoredPoses(const std::string& path) {
  std::vector<ScoredPose> poses;
  for (const NumberedRow& row : ReadRows(path, 9))
    poses.push_back({PoseOf(row, path), row.values[8]});
  return poses;
}

}  // namespace oaslam
