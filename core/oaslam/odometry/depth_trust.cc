#include "oaslam/odometry/depth_trust.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/util/median.h"

namespace oaslam {

bool DepthTrust::IsDue(double time_s) const {
  // A depth camera that agreed for so long seldom begins to disagree.
  constexpr int kOften = 10;
  constexpr double kSeconds = 1, kLaterSeconds = 10;
  return !judged_s_ || time_s - *judged_s_ >= (views_ < kOften ? kSeconds : kLaterSeconds);
}

void DepthTrust::Add(double time_s, std::span<const Views> at_zooms) {
  constexpr size_t kLeast = 50;  // points
  judged_s_ = time_s;
  for (const Views& views : at_zooms)
    if (views.size() < kLeast) return;
  ++views_;
  for (size_t zoom = 0; zoom < at_zooms.size(); ++zoom) {
    std::vector<double> off;
    for (const View& view : at_zooms[zoom]) off.push_back(view.log_ratio);
    const double median = Median(off);
    for (double& x : off) x = std::abs(x - median);
    if (zoom == kUnzoomed) {
      // Where the depths are right, one in twenty is off by three sigmas.
      constexpr double kMost = 3, kFloor = 0.02;
      int count = 0;
      for (size_t i = 0; i < off.size(); ++i)
        count += off[i] > kMost * std::hypot(at_zooms[zoom][i].sigma, kFloor);
      share_off_ += count / static_cast<double>(off.size());
    }
    spread_[zoom] += Median(std::move(off));
  }
}

std::string DepthTrust::Problem() const {
  constexpr int kLeast = 4;
  if (views_ < kLeast) return "";
  const auto best = std::ranges::min_element(spread_);
  // Of the depths as they were given; and the spread of the logarithm, with less of which they fit.
  constexpr double kBetter = 0.75, kFits = 0.01;
  if (spread_[kUnzoomed] > kFits * views_ && *best < kBetter * spread_[kUnzoomed])
    return fmt::format(
        "they fit the images better when magnified by {:.2f}: they are not registered to the "
        "colour images; give the depth camera's calibration",
        1 / kZooms[best - spread_.begin()]);
  constexpr double kMostOff = 0.4;
  if (share_off_ > kMostOff * views_)
    return fmt::format(
        "{:.0f} % of them contradict the parallax of the images: they are not registered, or of "
        "other images",
        100 * share_off_ / views_);
  return "";
}

}  // namespace oaslam
