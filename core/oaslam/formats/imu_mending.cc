#include "oaslam/formats/imu_mending.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/degree.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr double kLongestStep = 0.1;  // s; the odometry uses no turn with longer ones
constexpr double kStandardGravity = 9.80665;
// Fewer samples tell nothing of their unit.
constexpr size_t kFewest = 20;

// Keeps the samples for which `keep` holds, which is asked in their order.
template <typename Keep>
void KeepOnly(Keep keep, SensorSeries& series) {
  size_t kept = 0;
  for (size_t i = 0; i < series.times.size(); ++i) {
    if (!keep(i)) continue;
    series.times[kept] = series.times[i];
    series.values[kept] = series.values[i];
    series.lines[kept] = series.lines[i];
    ++kept;
  }
  series.times.resize(kept);
  series.values.resize(kept);
  series.lines.resize(kept);
}

void LeaveOutAll(SensorSeries& series) {
  KeepOnly([](size_t) { return false; }, series);
}

std::vector<double> LengthsOf(const SensorSeries& series) {
  std::vector<double> lengths;
  for (const Eigen::Vector3d& value : series.values) lengths.push_back(value.norm());
  return lengths;
}

// How much of the length of the samples is left in their mean over two seconds: much of gravity;
// little of what moves a hand, since its velocity is bounded. The median.
double Persistence(const SensorSeries& series) {
  constexpr double kWindow = 2;  // s
  std::vector<double> shares;
  for (size_t begin = 0; begin < series.times.size();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double lengths = 0;
    const double end = series.times[begin] + kWindow;
    for (; begin < series.times.size() && series.times[begin] <= end; ++begin) {
      sum += series.values[begin];
      lengths += series.values[begin].norm();
    }
    shares.push_back(lengths > 0 ? sum.norm() / lengths : 0);
  }
  return Median(std::move(shares));
}

// Whether the samples between two times differ by less than `motion`; not without samples.
bool IsStill(const SensorSeries& series, double begin_s, double end_s, double motion) {
  const auto begin = std::ranges::lower_bound(series.times, begin_s);
  const auto end = std::ranges::upper_bound(series.times, end_s);
  const auto first = series.values.begin() + (begin - series.times.begin());
  return begin < end &&
         std::all_of(first, first + (end - begin), [&](const Eigen::Vector3d& value) {
           return (value - *first).norm() < motion;
         });
}

}  // namespace

void LeaveOutDisorder(const std::string& sensor, SensorSeries& series,
                      std::vector<std::string>& notes) {
  size_t doubled = 0, back = 0, first_back = 0;
  double latest = 0, farthest = 0;
  const size_t all = series.times.size();
  KeepOnly(
      [&](size_t i) {
        const double time = series.times[i];
        const double next = i + 1 < all ? series.times[i + 1] : time;
        const bool is_later = i == 0 || time > latest;
        // A single one that is far ahead would make those after it go back.
        const bool jumps = is_later && next < time && (i == 0 || next > latest);
        if (is_later && !jumps) {
          latest = time;
          return true;
        }
        if (!jumps && time == latest) {
          ++doubled;
        } else {
          if (back++ == 0) first_back = series.lines[i];
          farthest = std::max(farthest, jumps ? time - next : latest - time);
        }
        return false;
      },
      series);
  if (doubled > 0)
    notes.push_back(
        fmt::format("{}: {} of {} samples have the time stamp of the one before: left out", sensor,
                    doubled, all));
  if (back > 0)
    notes.push_back(
        fmt::format("{}: the time stamps of {} of {} samples go back, by up to {:.3g} s, first in "
                    "line {}: left out",
                    sensor, back, all, farthest, first_back));
}

void LeaveOutStuck(const std::string& sensor, const SensorSeries& other, double motion,
                   SensorSeries& series, std::vector<std::string>& notes) {
  constexpr double kStuck = 0.5;  // s; the noise of a sensor changes its last digits sooner
  if (series.times.empty()) return;
  const double all = series.times.back() - series.times.front();
  std::vector<bool> is_stuck(series.times.size());
  size_t stuck = 0;
  double seconds = 0, first = 0;
  for (size_t begin = 0, end = 0; begin < series.times.size(); begin = end) {
    while (end < series.times.size() && series.values[end] == series.values[begin]) ++end;
    const double length = series.times[end - 1] - series.times[begin];
    if (end - begin < kFewest || length < kStuck) continue;
    if (2 * length < all && IsStill(other, series.times[begin], series.times[end - 1], motion))
      continue;
    if (stuck == 0) first = series.times[begin];
    stuck += end - begin;
    seconds += length;
    std::fill(is_stuck.begin() + static_cast<std::ptrdiff_t>(begin),
              is_stuck.begin() + static_cast<std::ptrdiff_t>(end), true);
  }
  if (stuck == 0) return;
  if (2 * stuck > series.times.size()) {
    notes.push_back(fmt::format("{}: stuck: it has one value for {:.1f} of {:.1f} s: not used",
                                sensor, seconds, all));
    return LeaveOutAll(series);
  }
  notes.push_back(fmt::format(
      "{}: stuck: it keeps one value for half a second or longer, {:.1f} s in all, first at {:.3f} "
      "s: left out there",
      sensor, seconds, first));
  KeepOnly([&](size_t i) { return !is_stuck[i]; }, series);
}

void ToRadians(SensorSeries& gyroscope, std::vector<std::string>& notes) {
  const std::string& unit = gyroscope.unit;
  const bool is_named = unit.find("deg") != std::string::npos || unit == "dps" ||
                        unit.find("\u00b0") != std::string::npos;
  // rad/s in a tenth of the time; a film of it would show nothing, and in degrees it is a slow
  // turn of the hand.
  constexpr double kFastest = 12, kShare = 0.9;
  std::vector<double> rates = LengthsOf(gyroscope);
  if (rates.size() < kFewest && !is_named) return;
  const auto high =
      rates.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(rates.size()));
  std::ranges::nth_element(rates, high);
  if (!is_named && *high <= kFastest) return;
  for (Eigen::Vector3d& value : gyroscope.values) value *= kDegree;
  notes.push_back(is_named ? std::string("gyroscope: deg/s by its header: converted to rad/s")
                           : fmt::format("gyroscope: faster than {:.3g} rad/s in a tenth of the "
                                         "time, more than a camera can turn: taken as deg/s",
                                         *high));
}

void ToMetres(SensorSeries& accelerometer, std::vector<std::string>& notes) {
  if (accelerometer.times.empty()) return;
  // Of a hand or a drone, whose accelerations are mostly less than gravity.
  constexpr double kLeast = 0.7, kMost = 1.35, kPersistent = 0.7;
  const double median = Median(LengthsOf(accelerometer));
  const bool is_named = accelerometer.unit == "g" || accelerometer.unit == "gs";
  const bool is_in_g =
      is_named || (median >= kLeast && median <= kMost && Persistence(accelerometer) > kPersistent);
  const double in_g = is_in_g ? median : median / kStandardGravity;
  if (in_g < kLeast || in_g > kMost) {
    notes.push_back(
        fmt::format("accelerometer: its median is {:.3g} {}, {}: only the gyroscope is used",
                    median, is_in_g ? "g" : "m/s^2",
                    in_g < kLeast ? "so that gravity is not in it (linear acceleration)"
                                  : "expected is that of gravity, 9.8 m/s^2 or 1 g"));
    return LeaveOutAll(accelerometer);
  }
  if (!is_in_g) return;
  for (Eigen::Vector3d& value : accelerometer.values) value *= kStandardGravity;
  notes.push_back(is_named
                      ? std::string("accelerometer: g by its header: converted to m/s^2")
                      : fmt::format("accelerometer: its median is {:.3g}: taken as g", median));
}

std::vector<ImuSample> Joined(const SensorSeries& gyroscope, const SensorSeries& accelerometer) {
  std::vector<ImuSample> samples;
  const auto& times = accelerometer.times;
  size_t after = 0;
  for (size_t i = 0; i < gyroscope.times.size(); ++i) {
    const double time = gyroscope.times[i];
    while (after < times.size() && times[after] < time) ++after;
    if (after == times.size()) break;
    const bool is_exact = times[after] == time;
    if (!is_exact && (after == 0 || times[after] - times[after - 1] > kLongestStep)) continue;
    ImuSample& sample = samples.emplace_back();
    sample.timestamp = time;
    sample.angular_velocity = gyroscope.values[i];
    sample.acceleration = accelerometer.values[after];
    if (is_exact) continue;
    const double share = (time - times[after - 1]) / (times[after] - times[after - 1]);
    sample.acceleration += (1 - share) * (accelerometer.values[after - 1] - sample.acceleration);
  }
  if (2 * samples.size() < gyroscope.times.size()) samples.clear();
  return samples;
}

std::string GapsOf(const std::vector<ImuSample>& samples) {
  size_t gaps = 0;
  double longest = 0, at = 0;
  for (size_t i = 1; i < samples.size(); ++i) {
    const double step = samples[i].timestamp - samples[i - 1].timestamp;
    if (step <= kLongestStep) continue;
    ++gaps;
    if (step > longest) longest = step, at = samples[i - 1].timestamp;
  }
  if (gaps == 0) return "";
  return fmt::format(
      "{} {} of more than {} s without samples, the longest {:.3g} s, at {:.3f} s: the camera "
      "moves by its images there",
      gaps, gaps == 1 ? "stretch" : "stretches", kLongestStep, longest, at);
}

}  // namespace oaslam
