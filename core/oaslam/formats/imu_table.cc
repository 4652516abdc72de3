#include "oaslam/formats/imu_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <string_view>

#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/time_unit.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

enum class Quantity { kOther, kTime, kBare, kRate, kAcceleration, kUserAcceleration, kGravity };

struct ColumnName {
  Quantity quantity = Quantity::kOther;
  size_t axis = 0;
  std::string unit;  // in brackets, or the last word
  std::string first_word;
};

Quantity QuantityOf(const std::vector<std::string>& words) {
  const auto has = [&](std::string_view letters, std::initializer_list<std::string_view> begins) {
    return std::ranges::any_of(words, [&](const std::string& word) {
      return (word.size() == 1 && letters.find(word) != std::string_view::npos) ||
             std::ranges::any_of(begins, [&](auto begin) { return word.starts_with(begin); });
    });
  };
  if (has("", {"grav"})) return Quantity::kGravity;
  if (has("", {"user"})) return Quantity::kUserAcceleration;
  if (has("a", {"acc"})) return Quantity::kAcceleration;
  if (has("wg", {"gyr", "omega", "alpha", "rot", "ang"})) return Quantity::kRate;
  return words.empty() || words.front() == "sensor" ? Quantity::kBare : Quantity::kOther;
}

// Of names such as "w_RS_S_x [rad s^-1]", "gx[rad/s]", "a_x", "Gyroscope x (rad/s)".
ColumnName NameOf(std::string_view text) {
  ColumnName name;
  std::vector<std::string> words(1);
  const std::string lower = Lower(std::string(text));
  const size_t bracket = std::min(lower.find_first_of("[("), lower.size());
  for (const char c : lower.substr(0, bracket)) {
    if (std::isalnum(static_cast<unsigned char>(c)))
      words.back() += c;
    else if (!words.back().empty())
      words.emplace_back();
  }
  if (words.back().empty()) words.pop_back();
  if (bracket < lower.size())
    name.unit = lower.substr(bracket + 1, lower.find_first_of("])", bracket) - bracket - 1);
  if (words.empty()) return name;
  const std::string& first = name.first_word = words.front();
  if (first == "t" || first.starts_with("sec") || std::ranges::any_of(words, [](const auto& word) {
        return word.find("time") != std::string::npos;
      })) {
    name.quantity = Quantity::kTime;
    if (name.unit.empty() && words.size() > 1) name.unit = words.back();
    return name;
  }
  const auto axis_of = [](char c) { return std::string_view("xyz").find(c); };
  auto at = std::ranges::find_if(words, [&](const std::string& word) {
    return word.size() == 1 && axis_of(word[0]) != std::string_view::npos;
  });
  if (at == words.end()) {  // "gx", "accelX"
    const std::string last = words.back();
    if (axis_of(last.back()) == std::string_view::npos) return name;
    words.back().pop_back();
    at = words.insert(words.end(), last.substr(last.size() - 1));
  }
  name.axis = axis_of(at->front());
  if (name.unit.empty() && at + 1 != words.end()) name.unit = words.back();
  words.erase(at, words.end());
  name.quantity = QuantityOf(words);
  return name;
}

std::optional<double> SecondsOfName(const std::string& unit) {
  for (const auto& [begin, seconds] :
       {std::pair("nano", 1e-9), std::pair("micro", 1e-6), std::pair("milli", 1e-3)})
    if (unit.starts_with(begin)) return seconds;
  if (unit.starts_with("sec")) return 1;
  return SecondsInUnit(unit == "µs" ? "us" : unit);
}

using Triple = std::array<size_t, 3>;

struct Columns {
  size_t time = 0;
  std::optional<double> time_unit;
  std::optional<Triple> rate, acceleration, gravity;  // gravity: to be added to the acceleration
  std::string rate_unit, acceleration_unit;
  bool is_toward_ground = false;
};

bool IsComment(std::string_view line) { return line.starts_with('#') || line.starts_with('%'); }

bool IsOfAccelerometer(const std::string& path) {
  return Lower(BaseName(path)).find("acc") != std::string::npos &&
         Lower(BaseName(path)).find("gyr") == std::string::npos;
}

// Nothing where the names are not those of an IMU.
std::optional<Columns> ColumnsOf(const std::vector<std::string_view>& header,
                                 const std::string& path) {
  std::vector<ColumnName> names;
  for (const std::string_view text : header) names.push_back(NameOf(text));
  const auto triple = [&](Quantity quantity) -> std::optional<Triple> {
    Triple columns;
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto found = std::ranges::find_if(names, [&](const ColumnName& name) {
        return name.quantity == quantity && name.axis == axis;
      });
      if (found == names.end()) return std::nullopt;
      columns[axis] = static_cast<size_t>(found - names.begin());
    }
    return columns;
  };
  const auto time = std::ranges::find(names, Quantity::kTime, &ColumnName::quantity);
  Columns columns;
  columns.rate = triple(Quantity::kRate);
  columns.acceleration = triple(Quantity::kAcceleration);
  if (!columns.rate && !columns.acceleration)
    (IsOfAccelerometer(path) ? columns.acceleration : columns.rate) = triple(Quantity::kBare);
  if (!columns.acceleration) {  // Core Motion divides it
    columns.acceleration = triple(Quantity::kUserAcceleration);
    if (columns.acceleration) columns.gravity = triple(Quantity::kGravity);
    columns.is_toward_ground = columns.gravity.has_value();
  }
  if (time == names.end() || (!columns.rate && !columns.acceleration)) return std::nullopt;
  columns.time = static_cast<size_t>(time - names.begin());
  columns.time_unit = SecondsOfName(time->unit);
  if (columns.rate) {
    columns.rate_unit = names[columns.rate->front()].unit;
    // So does Stray Scanner, which writes Core Motion's values, name angular velocities.
    columns.is_toward_ground |= names[columns.rate->front()].first_word == "alpha";
  }
  if (columns.acceleration) columns.acceleration_unit = names[columns.acceleration->front()].unit;
  return columns;
}

Columns ColumnsByPlace(size_t count, const std::string& path) {
  constexpr size_t kWithAcceleration = 7;
  Columns columns;
  const bool has_both = count >= kWithAcceleration;
  if (has_both || !IsOfAccelerometer(path)) columns.rate = {1, 2, 3};
  if (has_both) columns.acceleration = {4, 5, 6};
  if (!has_both && !columns.rate) columns.acceleration = {1, 2, 3};
  return columns;
}

std::vector<std::string_view> SplitRow(std::string_view line) {
  for (const char separator : {',', ';'})
    if (line.find(separator) != std::string_view::npos) return SplitCommas(line, separator);
  return SplitFields(line);
}

// The three values; nothing where the row has none of them.
std::optional<Eigen::Vector3d> ValuesAt(const std::vector<std::string_view>& fields,
                                        const Triple& columns, const std::string& path,
                                        size_t line) {
  if (std::ranges::all_of(columns, [&](size_t column) {
        return column < fields.size() &&
               (fields[column].empty() || Lower(std::string(fields[column])) == "nan");
      }))
    return std::nullopt;
  Eigen::Vector3d values;
  for (size_t i = 0; i < 3; ++i)
    values[static_cast<Eigen::Index>(i)] = NumberAt(fields, columns[i], path, line);
  return values;
}

void Add(double time, const Eigen::Vector3d& values, size_t line, SensorSeries& series) {
  series.times.push_back(time);
  series.values.push_back(values);
  series.lines.push_back(line);
}

// Units are a thousandfold apart, as are the bounds of what the spacing of an IMU's samples is.
double UnitOf(const SensorSeries& series, std::optional<double> named, const std::string& path,
              std::vector<std::string>& notes) {
  constexpr double kLeast = 1e-4, kMost = 0.1, kRounding = 1e-9;  // s
  constexpr double kUnits[] = {1, 1e-3, 1e-6, 1e-9};
  const double step = MedianStep(series.times);
  if (step == 0) return named.value_or(kUnits[3]);
  const auto fits = [&](double unit) {
    return step * unit >= kLeast * (1 - kRounding) && step * unit <= kMost * (1 + kRounding);
  };
  if (named && fits(*named)) return *named;
  const std::optional<double> date = UnitOfDate(series.times.front());
  const double* found = std::ranges::find_if(kUnits, fits);
  if (found == std::end(kUnits))
    throw BadInput(
        "{}:{}: time stamps from here on: median spacing {:.6g}, which is {} to {} s in none of s, "
        "ms, us, ns",
        path, series.lines.front(), step, kLeast, kMost);
  const double unit = date && fits(*date) ? *date : *found;
  if (named)
    notes.push_back(
        fmt::format("its header has times in {}, but by their spacing of {:.6g} they are in {}",
                    NameOfUnit(*named), step, NameOfUnit(unit)));
  return unit;
}

// What the lines before the first row of numbers tell.
struct Header {
  std::optional<Columns> columns;
  std::string_view unknown;  // names that are not of an IMU
  size_t unknown_line = 0;
};

void TakeHeader(std::string_view line, size_t number, const std::string& path, Header& header) {
  if (auto columns = ColumnsOf(SplitRow(IsComment(line) ? Trim(line.substr(1)) : line), path))
    header.columns = std::move(columns);
  else if (!IsComment(line))
    header.unknown = line, header.unknown_line = number;
}

Columns ColumnsOfRow(const Header& header, size_t fields, const std::string& path) {
  if (header.columns) return *header.columns;
  if (!header.unknown.empty())
    throw BadInput(
        "{}:{}: columns {}: expected a time and three axes of a gyroscope or accelerometer, "
        "such as timestamp, gx, gy, gz, ax, ay, az",
        path, header.unknown_line, Quoted(header.unknown));
  return ColumnsByPlace(fields, path);
}

void AddRow(const std::vector<std::string_view>& fields, const Columns& columns,
            const std::string& path, size_t line, ImuTable& table) {
  const double time = NumberAt(fields, columns.time, path, line);
  const auto values = [&](const std::optional<Triple>& of) {
    return of ? ValuesAt(fields, *of, path, line) : std::nullopt;
  };
  const auto rate = values(columns.rate), gravity = values(columns.gravity);
  auto acceleration = values(columns.acceleration);
  if (columns.gravity && acceleration)
    acceleration =
        gravity ? std::optional<Eigen::Vector3d>(*acceleration + *gravity) : std::nullopt;
  if (rate) Add(time, *rate, line, table.gyroscope);
  if (acceleration) Add(time, *acceleration, line, table.accelerometer);
}

}  // namespace

ImuTable LoadImuTable(const std::string& path) {
  ImuTable table;
  const std::string text = ReadTextFile(path);
  const std::vector<std::string_view> lines = SplitLines(text);
  Header header;
  std::optional<Columns> columns;  // once there is a row
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string_view line = Trim(lines[i]);
    if (line.empty() || (columns && IsComment(line))) continue;
    const auto fields = SplitRow(line);
    const size_t first = header.columns ? header.columns->time : 0;
    if (!columns && !(first < fields.size() && ParseNumber(fields[first]))) {
      TakeHeader(line, i + 1, path, header);
      continue;
    }
    const bool is_first = !columns;
    if (is_first) columns = ColumnsOfRow(header, fields.size(), path);
    try {
      AddRow(fields, *columns, path, i + 1, table);
    } catch (const InputError&) {
      if (is_first || i + 1 < lines.size() || text.ends_with('\n')) throw;
      table.notes.push_back(fmt::format("line {}, the last, breaks off: left out", i + 1));
    }
  }
  if (table.gyroscope.times.empty() && table.accelerometer.times.empty())
    throw BadInput("{}: no line \"timestamp,gx,gy,gz,ax,ay,az\" as in EuRoC's data.csv{}", path,
                   header.unknown.empty() ? "" : fmt::format(", only {}", Quoted(header.unknown)));
  table.is_toward_ground = columns->is_toward_ground;
  table.gyroscope.unit = columns->rate_unit;
  table.accelerometer.unit = columns->acceleration_unit;
  const double unit = UnitOf(table.gyroscope.times.empty() ? table.accelerometer : table.gyroscope,
                             columns->time_unit, path, table.notes);
  for (SensorSeries* series : {&table.gyroscope, &table.accelerometer})
    for (double& time : series->times) time *= unit;
  return table;
}

}  // namespace oaslam
