#include "oaslam/trajectory_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "oaslam/formats/pose_values.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/time_unit.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

// A line that is no comment.
struct Row {
  int line = 0;
  std::vector<std::string_view> fields;
};

// The lines of a file, which refer to its text.
struct Table {
  std::string path, text;
  std::vector<Row> rows;
  std::string header{};  // the last comment before the first row, or a first row of words
  bool has_commas = false;

  // The first `count` numbers of a row.
  std::vector<double> Numbers(const Row& row, size_t count) const {
    if (row.fields.size() < count)
      throw BadInput("{}:{}: {} columns, expected {}", path, row.line, row.fields.size(), count);
    std::vector<double> numbers;
    for (size_t i = 0; i < count; ++i) {
      const auto value = ParseNumber(row.fields[i]);
      if (!value)
        throw BadInput("{}:{}: {}, expected a number", path, row.line, Quoted(row.fields[i]));
      numbers.push_back(*value);
    }
    return numbers;
  }
};

void ReadRows(const std::string& path, Table& table) {
  table.path = path;
  table.text = ReadTextFile(path);
  int line_number = 0;
  for (const std::string_view line : SplitLines(table.text)) {
    ++line_number;
    const std::string_view trimmed = Trim(line);
    if (trimmed.empty()) continue;
    const bool has_commas = trimmed.find(',') != std::string_view::npos;
    if (trimmed[0] == '#' || (table.rows.empty() && has_commas && table.header.empty() &&
                              !ParseNumber(SplitCommas(trimmed)[0]))) {
      if (table.rows.empty()) table.header = Lower(trimmed);
      continue;
    }
    table.has_commas = table.has_commas || has_commas;
    table.rows.push_back({line_number, has_commas ? SplitCommas(trimmed) : SplitFields(trimmed)});
  }
}

StampedPose PoseOf(const std::vector<double>& v, const Table& table, const Row& row) {
  return {v[0], PoseOfQuaternion({v[7], v[4], v[5], v[6]}, {v[1], v[2], v[3]},
                                 fmt::format("{}:{}", table.path, row.line))};
}

// How many columns of the first row are numbers, if all are.
size_t NumbersInFirstRow(const Table& table) {
  const auto& fields = table.rows.front().fields;
  const bool are_numbers = std::ranges::all_of(
      fields, [](std::string_view field) { return ParseNumber(field).has_value(); });
  return are_numbers ? fields.size() : 0;
}

// Twelve numbers a line are the first three rows of a rigid motion, in KITTI's files. Their times
// are in times.txt beside them, a number a line.
std::vector<StampedPose> ReadKitti(const Table& table) {
  const std::string times_path =
      (std::filesystem::path(table.path).parent_path() / "times.txt").string();
  std::error_code error;
  if (!std::filesystem::exists(times_path, error))
    throw BadInput(
        "{}: has KITTI's twelve numbers a line, without times: put the times.txt of "
        "its images beside it, or give TUM's \"timestamp tx ty tz qx qy qz qw\"",
        table.path);
  Table times;
  ReadRows(times_path, times);
  if (times.rows.size() != table.rows.size())
    throw BadInput("{}: {} times, but {} has {} poses", times_path, times.rows.size(), table.path,
                   table.rows.size());
  std::vector<StampedPose> poses;
  for (size_t i = 0; i < table.rows.size(); ++i) {
    const std::optional<Rigid3> pose = PoseOfRows(table.Numbers(table.rows[i], 12));
    if (!pose)
      throw BadInput("{}:{}: twelve numbers, but no rotation as in KITTI's poses", table.path,
                     table.rows[i].line);
    poses.push_back({times.Numbers(times.rows[i], 1)[0], *pose});
  }
  return poses;
}

// The name of a column, in lower case, without prefix and unit: "q_RS_w []" is "w".
std::string_view ColumnTitle(std::string_view name) {
  name = name.substr(0, name.find_first_of(" ["));
  if (name.starts_with('#')) name = Trim(name.substr(1));
  for (const char* prefix : {"p_rs_r_", "q_rs_", "p_", "q_", "t", "q"})
    if (const std::string_view start(prefix); name.starts_with(start)) {
      const std::string_view rest = name.substr(start.size());
      if (rest == "x" || rest == "y" || rest == "z" || rest == "w") return rest;
    }
  return name;
}

// The columns of time, position, and quaternion (x, y, z, w), counted from 0.
using PoseColumns = std::array<size_t, 8>;
constexpr PoseColumns kTumColumns = {0, 1, 2, 3, 4, 5, 6, 7},
                      kEurocColumns = {0, 1, 2, 3, 5, 6, 7, 4};

// By a header with commas: three numbers and four, somewhere, of which the first are a position.
std::optional<PoseColumns> ColumnsOfHeader(const Table& table) {
  const std::vector<std::string_view> names = SplitCommas(table.header);
  PoseColumns columns{};
  std::array<std::vector<size_t>, 4> found;
  constexpr std::string_view kAxes = "xyzw";
  for (size_t i = 1; i < names.size(); ++i)
    if (const std::string_view name = ColumnTitle(names[i]); name.size() == 1)
      if (const size_t axis = kAxes.find(name); axis != std::string_view::npos)
        found[axis].push_back(i);
  for (size_t axis = 0; axis < 3; ++axis) {
    if (found[axis].size() < 2) return std::nullopt;
    columns[1 + axis] = found[axis][0];
    columns[4 + axis] = found[axis][1];
  }
  if (found[3].empty()) return std::nullopt;
  columns[7] = found[3][0];
  return columns;
}

// In files with commas a header tells them; those in nanoseconds without one are EuRoC's.
PoseColumns ColumnsOf(const Table& table, bool is_ns) {
  if (!table.has_commas) return kTumColumns;
  if (const auto columns = ColumnsOfHeader(table)) return *columns;
  if (is_ns) return kEurocColumns;
  throw BadInput(
      "{}: has commas, and no header that tells the order of its quaternions: give "
      "\"timestamp tx ty tz qx qy qz qw\" with blanks",
      table.path);
}

// The unit of the times: seconds, or that in which they are dates.
double UnitOfTimes(const Table& table) {
  std::vector<double> times;
  for (const Row& row : table.rows) times.push_back(table.Numbers(row, 1)[0]);
  const double date = UnitOfDate(times.front()).value_or(1);
  if (date < 1) {
    Log(LogLevel::kInfo, "{}: its times are in {}", table.path, NameOfUnit(date));
    return date;
  }
  if (table.header.find("[ns]") != std::string::npos) return 1e-9;
  constexpr double kLongest = 3600;  // between poses, seconds
  if (const double step = MedianStep(times); step > kLongest)
    throw BadInput("{}: the median step between its times is {:.6g}, they are not in seconds",
                   table.path, step);
  return 1;
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
  Table table;
  ReadRows(path, table);
  if (table.rows.empty()) return {};
  const size_t in_first = NumbersInFirstRow(table);
  std::vector<StampedPose> poses;
  if (in_first == 12) {
    poses = ReadKitti(table);
  } else if (in_first > 9 && !table.has_commas) {
    throw BadInput("{}:{}: {} numbers, expected TUM's \"timestamp tx ty tz qx qy qz qw\"", path,
                   table.rows.front().line, in_first);
  } else {
    const double unit = UnitOfTimes(table);
    const PoseColumns columns = ColumnsOf(table, unit == 1e-9);
    for (const Row& row : table.rows) {
      const std::vector<double> numbers =
          table.Numbers(row, *std::ranges::max_element(columns) + 1);
      std::vector<double> values;
      for (const size_t column : columns) values.push_back(numbers[column]);
      values[0] *= unit;
      poses.push_back(PoseOf(values, table, row));
    }
  }
  std::ranges::stable_sort(poses, {}, &StampedPose::timestamp);
  return poses;
}

void SaveTrajectory(const std::string& path, const std::vector<StampedPose>& poses) {
  std::string text;
  for (size_t i = 0; i < poses.size(); ++i)
    if (!IsFinite(poses[i])) throw BadInput("{}: pose {} has a number that is not finite", path, i);
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
  Table table;
  ReadRows(path, table);
  std::vector<ScoredPose> poses;
  for (const Row& row : table.rows) {
    const std::vector<double> values = table.Numbers(row, 9);
    poses.push_back({PoseOf(values, table, row), values[8]});
  }
  return poses;
}

}  // namespace oaslam
