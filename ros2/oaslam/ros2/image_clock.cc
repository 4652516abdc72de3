#include "oaslam/ros2/image_clock.h"

#include <algorithm>
#include <cmath>

namespace oaslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

double InSeconds(int64_t nanoseconds) {
  return static_cast<double>(nanoseconds / kSecond) +
         1e-9 * static_cast<double>(nanoseconds % kSecond);
}

}  // namespace

ImageClock::Step ImageClock::Add(int64_t stamp) {
  // Beyond a century times cannot be added any more.
  constexpr int64_t kLatest = kSecond * 86'400 * 365 * 100;
  if (stamp <= 0 || stamp > kLatest) return Step::kNone;
  if (!last_) {
    passes_ = {{InSeconds(stamp), 0}};
    last_ = stamp;
    return Step::kNext;
  }
  const int64_t interval = stamp - *last_;
  if (interval <= 0 && interval >= -kSecond) return Step::kNotNew;
  if (interval > 0) {
    CountMissed(interval);
    last_ = stamp;
    return Step::kNext;
  }
  const int64_t added = passes_.back().added + kSecond - interval;
  if (added > kLatest) return Step::kNotNew;
  passes_.push_back({InSeconds(stamp + added), added});
  last_ = stamp;
  return Step::kBack;
}

double ImageClock::Seconds(int64_t stamp) const {
  return InSeconds(stamp + (passes_.empty() ? 0 : passes_.back().added));
}

int64_t ImageClock::StampOf(double seconds) const {
  constexpr double kRounding = 1e-6;
  int64_t added = 0;
  for (const Pass& pass : passes_)
    if (seconds >= pass.begin_s - kRounding) added = pass.added;
  const double whole = std::floor(seconds);
  return static_cast<int64_t>(whole) * kSecond + std::llround((seconds - whole) * 1e9) - added;
}

double ImageClock::UsualInterval() const {
  std::vector<int64_t> sorted(intervals_.begin(), intervals_.end());
  std::ranges::sort(sorted);
  const auto at = [&](size_t share) { return static_cast<double>(sorted[sorted.size() / share]); };
  // Where most images are lost, the shorter intervals are still those of the camera.
  constexpr double kUnlike = 0.6;
  const double middle = at(2), quarter = at(4);
  return quarter < kUnlike * middle ? quarter : middle;
}

void ImageClock::CountMissed(int64_t interval) {
  constexpr size_t kMost = 31, kLeast = 5;
  constexpr int64_t kPause = 2 * kSecond;
  if (interval > kPause) {
    gap_ = 0;
    return;
  }
  if (intervals_.size() >= kLeast) {
    constexpr double kGap = 1.5;
    const double steps = static_cast<double>(interval) / UsualInterval();
    // An image that was only late is followed by the next one soon.
    if (gap_ > 0)
      missed_ += std::max(0, static_cast<int>(std::lround(gap_ + std::min(steps, 1.0))) - 2);
    gap_ = steps > kGap ? steps : 0;
  }
  intervals_.push_back(interval);
  if (intervals_.size() > kMost) intervals_.pop_front();
}

}  // namespace oaslam
