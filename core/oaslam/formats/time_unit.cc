#include "oaslam/formats/time_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "oaslam/formats/text.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr std::array<std::pair<std::string_view, double>, 4> kUnits = {
    {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}};

// Digits with at most one decimal point among them.
std::optional<double> PlainNumber(std::string_view text) {
  const bool is_plain = text.find_first_not_of("0123456789.") == std::string_view::npos &&
                        !text.starts_with('.') && !text.ends_with('.');
  return is_plain ? ParseNumber(text) : std::nullopt;
}

}  // namespace

std::optional<double> SecondsInUnit(std::string_view name) {
  for (const auto& [known, seconds] : kUnits)
    if (known == name) return seconds;
  return std::nullopt;
}

std::string_view NameOfUnit(double seconds) {
  return std::ranges::find(kUnits, seconds, &std::pair<std::string_view, double>::second)->first;
}

std::optional<double> UnitOfDate(double time) {
  constexpr double kFirst = 978307200, kLast = 4102444800;  // 2001 and 2100, in seconds
  for (const auto& [name, unit] : kUnits)
    if (time * unit >= kFirst && time * unit <= kLast) return unit;
  return std::nullopt;
}

double MedianStep(const std::vector<double>& times) {
  std::vector<double> steps;
  for (size_t i = 1; i < times.size(); ++i)
    if (times[i] != times[i - 1]) steps.push_back(std::abs(times[i] - times[i - 1]));
  return steps.empty() ? 0 : Median(std::move(steps));
}

double UnitOfStep(double step) {
  constexpr double kLongest = 5;  // seconds
  for (const auto& [name, unit] : kUnits)
    if (step * unit <= kLongest) return unit;
  return kUnits.back().second;
}

std::string ProblemOfSteps(const std::vector<double>& times) {
  constexpr double kShortest = 1e-4, kLongest = 3600;  // seconds
  // So many images at such a step are rather a film in milliseconds.
  constexpr double kLongestOfFilm = 5;
  constexpr size_t kFilm = 10;
  const double step = MedianStep(times);
  if (step == 0) return "";
  const std::optional<double> date = UnitOfDate(times.front());
  const bool is_film = times.size() >= kFilm && step > kLongestOfFilm && date != 1.0;
  if (step < kShortest)
    return fmt::format("the median step between images is {:.3g} s, allowed: {} to {} s", step,
                       kShortest, kLongest);
  if (step <= kLongest && !is_film) return "";
  const double unit = date && *date < 1 ? *date : UnitOfStep(step);
  if (unit == 1)
    return fmt::format("the median step between images is {:.3g} s, allowed: {} to {} s", step,
                       kShortest, kLongest);
  return fmt::format(
      "the median step between images is {:.6g}, which looks like {}, not s: --time-unit {}{}",
      step, NameOfUnit(unit), NameOfUnit(unit), step <= kLongest ? ", or s if it is s" : "");
}

std::optional<NameTimes> TimesOfNames(const std::vector<std::string>& names,
                                      std::optional<double> unit) {
  std::vector<double> numbers;
  bool has_point = false;
  std::map<double, std::string> seen;
  for (const std::string& name : names) {
    const std::string stem = WithoutExtension(BaseName(name));
    const std::optional<double> number = PlainNumber(stem);
    if (!number) return std::nullopt;
    // 1.1 and 1.10 are numbered chapters.
    if (const auto [other, is_new] = seen.emplace(*number, stem);
        !is_new && other->second != stem && !unit)
      return std::nullopt;
    has_point = has_point || stem.find('.') != std::string::npos;
    numbers.push_back(*number);
  }
  if (numbers.empty()) return std::nullopt;
  if (!unit) {
    const std::optional<double> date = UnitOfDate(numbers.front());
    const bool is_date = std::ranges::all_of(
        numbers, [&](double number) { return date && UnitOfDate(number) == date; });
    // Whole numbers of the size of seconds since 1970 may count anything.
    if (!has_point && !(is_date && *date < 1)) return std::nullopt;
    unit = is_date ? *date : 1;
  }
  for (double& number : numbers) number *= *unit;
  return NameTimes{std::move(numbers), *unit};
}

}  // namespace oaslam
