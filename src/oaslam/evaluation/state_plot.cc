#include "oaslam/evaluation/state_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "oaslam/exports/svg.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"

namespace oaslam {
namespace {

struct StateStyle {
  const char* state;
  const char* meaning;
  const char* color;
};

constexpr std::array kStates = {
    StateStyle{"tracking", "tracked by points", "#15803d"},
    StateStyle{"relocalized", "relocalized by points", "#1d4ed8"},
    StateStyle{"odometry", "by the camera's motion alone", "#a3b18a"},
    StateStyle{"preliminary", "by its first motion, without a map", "#c4b5fd"},
    StateStyle{"objects", "found by objects alone", "#f59e0b"},
    StateStyle{"filled", "lost at the time, filled in afterwards", "#86efac"},
    StateStyle{"initializing", "initializing", "#9ca3af"},
    StateStyle{"lost", "lost", "#dc2626"}};

}  // namespace

StateRow LoadStates(const std::string& frames_csv) {
  const std::string text = ReadTextFile(frames_csv);
  const auto lines = SplitLines(text);
  if (lines.empty()) throw InputError(fmt::format("{}: empty", frames_csv));
  const size_t time = ColumnOf(lines[0], {"timestamp"}, frames_csv),
               state = ColumnOf(lines[0], {"state"}, frames_csv),
               filled = ColumnOf(lines[0], {"filled"}, frames_csv);
  StateRow row;
  for (size_t i = 1; i < lines.size(); ++i) {
    if (Trim(lines[i]).empty()) continue;
    const auto fields = SplitCommas(lines[i]);
    row.timestamps.push_back(NumberAt(fields, time, frames_csv, i + 1));
    const bool is_filled = NumberAt(fields, filled, frames_csv, i + 1) != 0;
    const std::string name = is_filled               ? "filled"
                             : state < fields.size() ? std::string(fields[state])
                                                     : "";
    if (std::ranges::find(kStates, name, &StateStyle::state) == kStates.end())
      throw InputError(fmt::format("{}:{}: state \"{}\" is unknown", frames_csv, i + 1, name));
    row.states.push_back(name);
  }
  if (row.states.empty()) throw InputError(fmt::format("{}: no frames", frames_csv));
  return row;
}

void SaveStatePlot(const std::string& path, const std::vector<StateRow>& rows,
                   const std::string& title) {
  constexpr double kLeft = 24, kTop = 56, kWidth = 720, kBand = 34, kPitch = 66, kLegendRow = 22;
  double first = std::numeric_limits<double>::max(), last = std::numeric_limits<double>::lowest();
  for (const StateRow& row : rows) {
    first = std::min(first, row.timestamps.front());
    last = std::max(last, row.timestamps.back());
  }
  const double seconds = std::max(last - first, 1e-3);
  const double axis = kTop + kPitch * static_cast<double>(rows.size()) + 4;
  SvgCanvas canvas(kLeft * 2 + kWidth, axis + 56 + kLegendRow * kStates.size() / 2);
  canvas.Text({kLeft, 32}, title, 18, "start", R"(fill="#111" font-weight="bold")");
  const auto x_of = [&](double t) { return kLeft + kWidth * (t - first) / seconds; };
  for (size_t r = 0; r < rows.size(); ++r) {
    const StateRow& row = rows[r];
    const double y = kTop + kPitch * static_cast<double>(r);
    const auto lost = std::ranges::count_if(
        row.states, [](const std::string& s) { return s == "lost" || s == "initializing"; });
    canvas.Text({kLeft, y + 12},
                fmt::format("{}: {:.0f} % of {} frames have a pose", row.name,
                            100 - 100.0 * static_cast<double>(lost) /
                                      static_cast<double>(row.states.size()),
                            row.states.size()),
                13);
    for (size_t begin = 0; begin < row.states.size();) {
      size_t end = begin + 1;
      while (end < row.states.size() && row.states[end] == row.states[begin]) ++end;
      const double until = end < row.states.size() ? row.timestamps[end] : row.timestamps.back();
      const auto style = std::ranges::find(kStates, row.states[begin], &StateStyle::state);
      canvas.Rectangle({x_of(row.timestamps[begin]), y + 20},
                       {x_of(until) - x_of(row.timestamps[begin]), kBand},
                       fmt::format(R"(fill="{}")", style->color));
      begin = end;
    }
  }
  const double step = RoundStep(seconds / 6);
  for (int i = 0; i * step <= seconds; ++i)
    canvas.Text({x_of(first + i * step), axis + 14}, fmt::format("{:g}", i * step), 12, "middle");
  canvas.Text({kLeft + kWidth / 2, axis + 34}, "time [s]", 13, "middle");
  for (size_t i = 0; i < kStates.size(); ++i) {
    const double x = kLeft + (i % 2 == 0 ? 0 : kWidth / 2),
                 y = axis + 54 + kLegendRow * static_cast<double>(i / 2);
    canvas.Rectangle({x, y - 11}, {22, 13}, fmt::format(R"(fill="{}")", kStates[i].color));
    canvas.Text({x + 30, y}, kStates[i].meaning, 13);
  }
  WriteTextFile(path, canvas.Finish());
}

}  // namespace oaslam
