#include "oaslam/odometry/depth_trust.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// Images that a judgement needs.
constexpr int kLeastViews = 4;

// The distances of logarithms from their median.
std::vector<double> DistancesFromMedian(const DepthTrust::Views& views,
                                        double DepthTrust::View::*logarithm) {
  std::vector<double> off;
  for (const DepthTrust::View& view : views) off.push_back(view.*logarithm);
  const double median = Median(off);
  for (double& x : off) x = std::abs(x - median);
  return off;
}

std::string Describe(const DepthReading& reading) {
  if (reading.offset != 0)
    return fmt::format("they fit the images better with {:.1f} m added: they have an offset",
                       reading.offset);
  if (reading.delay != 0)
    return fmt::format(
        "they fit the images of {:.2f} s {} better: the clock of the depth camera is {}",
        std::abs(reading.delay), reading.delay > 0 ? "before" : "after",
        reading.delay > 0 ? "late" : "early");
  return fmt::format(
      "they fit the images better when magnified by {:.2f}: they are not registered to the colour "
      "images; give the depth camera's calibration",
      1 / reading.zoom);
}

}  // namespace

bool DepthTrust::IsDue(double time_s) const {
  // A depth camera that agreed for so long seldom begins to disagree.
  constexpr int kOften = 10;
  constexpr double kFirstSeconds = 0.4, kSeconds = 1, kLaterSeconds = 10;
  const double wait =
      views_ < kLeastViews ? kFirstSeconds : (views_ < kOften ? kSeconds : kLaterSeconds);
  return !judged_s_ || time_s - *judged_s_ >= wait;
}

void DepthTrust::Add(double time_s, std::span<const Views> by_reading) {
  constexpr size_t kLeast = 50;  // points
  judged_s_ = time_s;
  if (by_reading[kAsGiven].size() < kLeast) return;
  ++views_;
  // Where the depths are right, one in twenty is off by three sigmas.
  constexpr double kMost = 3, kFloor = 0.02;
  const std::vector<double> off =
      DistancesFromMedian(by_reading[kAsGiven], &DepthTrust::View::log_ratio);
  int count = 0;
  for (size_t i = 0; i < off.size(); ++i)
    count += off[i] > kMost * std::hypot(by_reading[kAsGiven][i].sigma, kFloor);
  share_off_ += count / static_cast<double>(off.size());
  for (size_t i = 0; i < by_reading.size(); ++i) {
    if (by_reading[i].size() < kLeast) continue;
    ++fits_[i].images;
    fits_[i].spread += Median(DistancesFromMedian(by_reading[i], &DepthTrust::View::log_ratio));
    fits_[i].as_given += Median(DistancesFromMedian(by_reading[i], &DepthTrust::View::as_given));
  }
}

std::string DepthTrust::Problem() const {
  if (views_ < kLeastViews) return "";
  // Of the depths as they were given; and the spread of the logarithm, with
  // less of which they fit.
  constexpr double kBetter = 0.75, kFits = 0.01;
  size_t best = kAsGiven;
  for (size_t i = 0; i < fits_.size(); ++i)
    if (fits_[i].images >= kLeastViews && fits_[i].Ratio() < fits_[best].Ratio()) best = i;
  if (fits_[kAsGiven].spread > kFits * views_ && fits_[best].Ratio() < kBetter)
    return Describe(kReadings[best]);
  constexpr double kMostOff = 0.4;
  if (share_off_ > kMostOff * views_)
    return fmt::format(
        "{:.0f} % of them contradict the parallax of the "
        "images: they are not registered, or of "
        "other images",
        100 * share_off_ / views_);
  return "";
}

}  // namespace oaslam
