#include "gravity_file.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/median.h"

namespace oaslam::apps {
namespace {

// In sample intervals: two samples may be missing, and the nearest is at most that far from an
// image in the middle of such a gap.
constexpr double kWidestGap = 3, kFarthest = 1.5;

}  // namespace

GravityTrack GravityTrack::Load(const std::string& path) {
  GravityTrack track;
  track.path_ = path;
  const std::string text = ReadTextFile(path);
  int number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++number;
    const std::string_view content = Trim(line);
    if (content.empty() || content.front() == '#') continue;
    std::vector<double> values;
    for (const std::string_view field : SplitFields(content))
      if (const auto value = ParseNumber(field)) values.push_back(*value);
    const bool valid = values.size() == 4 && SplitFields(content).size() == 4;
    if (!valid || Eigen::Vector3d(values[1], values[2], values[3]).norm() == 0)
      throw BadInput("{}:{}: expected \"timestamp gx gy gz\", not all zero", path, number);
    track.samples_.push_back({values[0], {values[1], values[2], values[3]}});
  }
  if (track.samples_.empty()) throw BadInput("{}: no line \"timestamp gx gy gz\"", path);
  std::ranges::stable_sort(track.samples_, {}, &Sample::timestamp);
  std::vector<double> gaps;
  for (size_t i = 1; i < track.samples_.size(); ++i)
    if (const double gap = track.samples_[i].timestamp - track.samples_[i - 1].timestamp; gap > 0)
      gaps.push_back(gap);
  // A single sample has no rate: it is used for its own time.
  constexpr double kIntervalOfOne = 0.02;  // seconds: phones give 50 or 100 samples a second
  track.interval_ = gaps.empty() ? kIntervalOfOne : Median(std::move(gaps));
  return track;
}

std::optional<Eigen::Vector3d> GravityTrack::Smoothed(double timestamp) const {
  constexpr double kReach = 0.1;  // seconds: a hand trembles faster, and turns more slowly
  constexpr int kEnough = 4;      // samples: a line through fewer follows the noise
  const auto begin = std::ranges::lower_bound(samples_, timestamp - kReach, {}, &Sample::timestamp);
  const auto end = std::ranges::upper_bound(samples_, timestamp + kReach, {}, &Sample::timestamp);
  if (end - begin < kEnough || begin->timestamp > timestamp || (end - 1)->timestamp < timestamp)
    return std::nullopt;
  double n = 0, dt = 0, dt_squared = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  for (auto sample = begin; sample != end; ++sample) {
    const double t = sample->timestamp - timestamp;
    ++n;
    dt += t;
    dt_squared += t * t;
    sum += sample->in_cam;
    moment += t * sample->in_cam;
  }
  const double determinant = n * dt_squared - dt * dt;
  if (!(determinant > 0)) return std::nullopt;
  const Eigen::Vector3d value = (dt_squared * sum - dt * moment) / determinant;
  return value.norm() > 0 ? std::optional(value) : std::nullopt;
}

std::optional<Eigen::Vector3d> GravityTrack::At(double timestamp) {
  if (samples_.empty()) return std::nullopt;
  if (!first_asked_) first_asked_ = timestamp;
  last_asked_ = timestamp;
  if (const auto smoothed = Smoothed(timestamp)) {
    is_used_ = true;
    return smoothed;
  }
  const auto after = std::ranges::lower_bound(samples_, timestamp, {}, &Sample::timestamp);
  const auto before = after == samples_.begin() ? after : after - 1;
  if (after != samples_.end() && after->timestamp - before->timestamp <= kWidestGap * interval_ &&
      before->timestamp <= timestamp) {
    const double gap = after->timestamp - before->timestamp;
    const double share = gap > 0 ? (timestamp - before->timestamp) / gap : 0;
    const Eigen::Vector3d between = (1 - share) * before->in_cam + share * after->in_cam;
    if (between.norm() > 0) {
      is_used_ = true;
      return between;
    }
  }
  const bool is_before =
      after == samples_.end() || timestamp - before->timestamp < after->timestamp - timestamp;
  const Sample& nearest = is_before ? *before : *after;
  if (std::abs(nearest.timestamp - timestamp) > kFarthest * interval_) return std::nullopt;
  is_used_ = true;
  return nearest.in_cam;
}

void GravityTrack::WarnIfUnused() const {
  if (is_used_ || !first_asked_) return;
  spdlog::warn(
      "{}: no sample near any image: it has {:.3f} to {:.3f} s, the images {:.3f} to {:.3f} s",
      path_, samples_.front().timestamp, samples_.back().timestamp, *first_asked_, *last_asked_);
}

}  // namespace oaslam::apps
