#include "oaslam/evaluation/trajectory_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "oaslam/util/median.h"

namespace oaslam {

ErrorStatistics StatisticsOf(std::vector<double> errors) {
  ErrorStatistics s;
  s.count = errors.size();
  if (errors.empty()) return s;
  const auto n = static_cast<double>(errors.size());
  for (const double e : errors) s.rmse += e * e / n, s.mean += e / n;
  s.rmse = std::sqrt(s.rmse);
  std::ranges::sort(errors);
  const size_t half = errors.size() / 2;
  s.median = errors.size() % 2 == 1 ? errors[half] : (errors[half - 1] + errors[half]) / 2;
  s.max = errors.back();
  return s;
}

namespace {

// Why there are no pairs, or nearly none: most often another unit or another beginning of the
// times.
std::string DescribeTimes(const std::vector<StampedPose>& reference,
                          const std::vector<StampedPose>& estimate) {
  if (reference.empty() || estimate.empty()) return "";
  return fmt::format(
      "; its times are {:.2f} to {:.2f} s, those of the ground truth {:.2f} to {:.2f} s",
      estimate.front().timestamp, estimate.back().timestamp, reference.front().timestamp,
      reference.back().timestamp);
}

}  // namespace

TrajectoryReport EvaluateTrajectory(const std::vector<StampedPose>& reference_poses,
                                    const std::vector<StampedPose>& estimated_poses,
                                    AlignMode mode) {
  const auto reference = WithoutDuplicates(reference_poses),
             estimate = WithoutDuplicates(estimated_poses);
  const auto pairs = Associate(reference, estimate);
  TrajectoryReport report;
  report.pairs = pairs.size();
  if (pairs.empty()) {
    report.why_not = fmt::format("no pose within {} s of the ground truth{}", kMaxTimeDifference,
                                 DescribeTimes(reference, estimate));
    return report;
  }
  const auto alignment = AlignPositions(reference, estimate, pairs, mode);
  if (!alignment) {
    report.why_not = fmt::format("{} of {} poses with ground truth do not determine an alignment{}",
                                 pairs.size(), estimate.size(), DescribeTimes(reference, estimate));
    return report;
  }
  std::vector<double> position, rotation;
  for (const auto& [r, q] : pairs) {
    const PoseError error = ErrorOf(reference[r], estimate[q], *alignment);
    position.push_back(error.position);
    report.position_errors.emplace_back(estimate[q].timestamp, error.position);
    rotation.push_back(error.rotation_deg);
  }
  report.success = true;
  report.reference_from_estimate = *alignment;
  report.position = StatisticsOf(std::move(position));
  report.rotation_deg = StatisticsOf(std::move(rotation));
  return report;
}

namespace {

// Pairs of indices into `pairs` that are one interval apart.
std::vector<std::pair<size_t, size_t>> Intervals(const std::vector<StampedPose>& estimate,
                                                 const std::vector<AssociatedPair>& pairs,
                                                 double interval_s) {
  std::vector<StampedPose> at;
  for (const AssociatedPair& pair : pairs) at.push_back({estimate[pair.query].timestamp, {}});
  std::vector<std::pair<size_t, size_t>> intervals;
  if (interval_s > 0) {
    std::vector<StampedPose> later = at;
    for (StampedPose& pose : later) pose.timestamp += interval_s;
    for (const auto& [end, begin] : Associate(at, later)) intervals.emplace_back(begin, end);
    return intervals;
  }
  std::vector<double> steps;
  for (size_t i = 1; i < at.size(); ++i) steps.push_back(at[i].timestamp - at[i - 1].timestamp);
  const double usual = StatisticsOf(steps).median;
  for (size_t i = 1; i < at.size(); ++i)
    if (steps[i - 1] <= 2 * usual) intervals.emplace_back(i - 1, i);
  return intervals;
}

}  // namespace

ConsistencyReport EvaluateConsistency(const TrajectoryReport& report,
                                      const std::vector<std::pair<double, double>>& sigmas) {
  constexpr double kSameTime = 1e-6;  // seconds: as written to a file
  ConsistencyReport consistency;
  std::vector<double> squares;
  for (const auto& [timestamp, error] : report.position_errors) {
    const auto stated = std::ranges::lower_bound(sigmas, timestamp - kSameTime, {},
                                                 &std::pair<double, double>::first);
    if (stated == sigmas.end() || stated->first > timestamp + kSameTime || !(stated->second > 0))
      continue;
    const double off = error / (report.reference_from_estimate.scale * stated->second);
    squares.push_back(off * off);
    consistency.share_beyond += off > 3;
  }
  consistency.count = squares.size();
  if (squares.empty()) return consistency;
  consistency.share_beyond /= static_cast<double>(squares.size());
  consistency.median = Median(std::move(squares));
  return consistency;
}

RelativeReport EvaluateRelative(const std::vector<StampedPose>& reference_poses,
                                const std::vector<StampedPose>& estimated_poses, double scale,
                                double interval_s) {
  const auto reference = WithoutDuplicates(reference_poses),
             estimate = WithoutDuplicates(estimated_poses);
  const auto pairs = Associate(reference, estimate);
  std::vector<double> translation, rotation;
  for (const auto& [begin, end] : Intervals(estimate, pairs, interval_s)) {
    const Rigid3 true_motion = reference[pairs[begin].reference].world_from_cam.Inverse() *
                               reference[pairs[end].reference].world_from_cam;
    Rigid3 motion = estimate[pairs[begin].query].world_from_cam.Inverse() *
                    estimate[pairs[end].query].world_from_cam;
    motion.translation *= scale;
    const Rigid3 error = true_motion.Inverse() * motion;
    translation.push_back(error.translation.norm());
    rotation.push_back(error.rotation.angularDistance(Eigen::Quaterniond::Identity()) * 180 /
                       std::numbers::pi);
  }
  return {StatisticsOf(std::move(translation)), StatisticsOf(std::move(rotation))};
}

}  // namespace oaslam
