#include "oaslam/odometry/gyroscope.h"

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

// Candidates for the offset have this distance and reach to kMostOffset on both sides, since a
// browser gives images up to two tenths of a second late.
constexpr double kStep = 0.005;  // s
constexpr int kCandidates = 2 * static_cast<int>(Gyroscope::kMostOffset / kStep) + 1;
// Standard deviations before the images tell anything. The clock of a phone's camera is within some
// tens of milliseconds of its gyroscope's.
constexpr double kOffsetBefore = 0.05;  // s
// A phone's gyroscope has a bias of up to 3 deg/s (data sheet of Bosch's BMI160).
constexpr double kBiasBefore = 2 * kDegree;
// The rotation between two blurred images has errors of this size. They count as much as those of
// so many comparisons.
constexpr double kSigmaBefore = 0.2 * kDegree, kCountBefore = 10;
constexpr double kMemory = 30;      // s: in a minute the bias of a phone's gyroscope hardly changes
constexpr double kWidestGap = 0.1;  // s between samples: a hand may begin to turn in more
constexpr double kBeyond = 0.02;    // s after the last sample: the rate stays
constexpr double kKept = 5;         // s of samples

Eigen::Vector3d VectorOf(const Eigen::Quaterniond& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

double OffsetOf(double candidate) { return (candidate - (kCandidates - 1) / 2) * kStep; }

}  // namespace

Gyroscope::Gyroscope() : errors_(kCandidates), calibration_(*BestCalibration()) {}

void Gyroscope::Add(std::span<const AngularVelocity> samples) {
  for (const AngularVelocity& s : samples) {
    if (samples_.empty()) {
      samples_.push_back({s.timestamp, s.in_cam, {Eigen::Quaterniond::Identity()}});
      continue;
    }
    const Sample& last = samples_.back();
    const double elapsed = s.timestamp - last.time_s;
    if (!(elapsed > 0)) continue;
    const Eigen::Quaterniond turn = RotationOf(0.5 * elapsed * (last.rate + s.in_cam));
    samples_.push_back({s.timestamp,
                        s.in_cam,
                        {(last.orientation.start_from_camera * turn).normalized(),
                         last.orientation.segment + (elapsed > kWidestGap)}});
  }
  while (!waiting_.empty() && samples_.back().time_s >= waiting_.front().second_s + kMostOffset) {
    Learn(waiting_.front());
    waiting_.pop_front();
  }
  while (samples_.size() > 1 && samples_.front().time_s < samples_.back().time_s - kKept)
    samples_.pop_front();
}

std::optional<Gyroscope::Orientation> Gyroscope::OrientationAt(double time_s) const {
  const auto after = std::ranges::lower_bound(samples_, time_s, {}, &Sample::time_s);
  if (after == samples_.begin()) return std::nullopt;
  const Sample& before = *(after - 1);
  const double elapsed = time_s - before.time_s;
  Eigen::Vector3d rate = before.rate;
  if (after == samples_.end()) {
    if (elapsed > kBeyond) return std::nullopt;
  } else {
    if (after->orientation.segment != before.orientation.segment) return std::nullopt;
    rate += 0.5 * elapsed / (after->time_s - before.time_s) * (after->rate - before.rate);
  }
  return Orientation{before.orientation.start_from_camera * RotationOf(elapsed * rate),
                     before.orientation.segment};
}

std::optional<Eigen::Quaterniond> Gyroscope::Integral(double first_s, double second_s) const {
  const auto first = OrientationAt(first_s), second = OrientationAt(second_s);
  if (!first || !second || first->segment != second->segment) return std::nullopt;
  return first->start_from_camera.conjugate() * second->start_from_camera;
}

Eigen::Vector3d Gyroscope::RateAt(double time_s) const {
  const auto after = std::ranges::lower_bound(samples_, time_s, {}, &Sample::time_s);
  return after == samples_.end() ? samples_.back().rate : after->rate;
}

std::optional<Turn> Gyroscope::Between(double first_s, double second_s) const {
  return is_trusted_ ? Calibrated(first_s, second_s) : std::nullopt;
}

std::optional<Turn> Gyroscope::Calibrated(double first_s, double second_s) const {
  const double begin = first_s + calibration_.offset_s, end = second_s + calibration_.offset_s;
  const auto integral = Integral(begin, end);
  if (!integral) return std::nullopt;
  const double elapsed = end - begin;
  // The bias acts about the axes at each time; those in the middle stand for them.
  const Eigen::Quaterniond half = RotationOf(-0.5 * VectorOf(*integral));
  const Eigen::Quaterniond unbiased = half * RotationOf(elapsed * calibration_.bias) * half;
  // Sensitivity and axes are taken to be right to a hundredth.
  constexpr double kOfAngle = 0.01;
  const double of_angle = kOfAngle * VectorOf(unbiased).norm();
  // The error of the bias is the same in all images of a window, some two seconds: errors that do
  // not depend on each other add up to as much if each is larger.
  constexpr double kWindow = 2;  // s
  const double of_bias = calibration_.sigma_bias * std::sqrt(elapsed * std::max(elapsed, kWindow));
  const double of_offset = calibration_.sigma_offset_s * (RateAt(end) - RateAt(begin)).norm();
  return Turn{unbiased.normalized(), calibration_.sigma * calibration_.sigma + of_angle * of_angle +
                                         of_bias * of_bias + of_offset * of_offset};
}

void Gyroscope::Compare(double first_s, double second_s,
                        const Eigen::Quaterniond& second_from_first) {
  // Of a gyroscope that gives no more samples nothing is learned.
  if (!samples_.empty() && samples_.back().time_s > second_s - kKept)
    waiting_.push_back({first_s, second_s, second_from_first.conjugate()});
}

void Gyroscope::Learn(const Comparison& comparison) {
  std::vector<Eigen::Vector3d> errors, by_samples;
  for (int i = 0; i < kCandidates; ++i) {
    const auto integral =
        Integral(comparison.first_s + OffsetOf(i), comparison.second_s + OffsetOf(i));
    if (!integral) return;  // the candidates must be compared by the same images
    by_samples.push_back(VectorOf(*integral));
    errors.push_back(VectorOf(comparison.first_from_second.conjugate() * *integral));
  }
  const double duration = comparison.second_s - comparison.first_s;
  double weight = 1;
  if (const auto turn = Calibrated(comparison.first_s, comparison.second_s)) {
    // A pose may be wrong by ten degrees and fit: what is beyond three sigmas counts less.
    const Eigen::Vector3d off = VectorOf(comparison.first_from_second * turn->second_from_first);
    constexpr double kFar = 3;
    weight = 1 / (1 + off.squaredNorm() / (3 * kFar * kFar * turn->variance));
  }
  const double kept = std::exp(-duration / kMemory);
  compared_ = kept * compared_ + 1;
  agreed_ = kept * agreed_ + weight;
  squared_duration_ = kept * squared_duration_ + weight * duration * duration;
  const Eigen::Vector3d by_images = VectorOf(Eigen::Quaterniond(comparison.first_from_second));
  of_images_ = kept * of_images_ + by_images.squaredNorm();
  for (int i = 0; i < kCandidates; ++i) {
    errors_[i].by_duration = kept * errors_[i].by_duration + weight * duration * errors[i];
    errors_[i].squared = kept * errors_[i].squared + weight * errors[i].squaredNorm();
    errors_[i].product = kept * errors_[i].product + by_images * by_samples[i].transpose();
    errors_[i].of_samples = kept * errors_[i].of_samples + by_samples[i].squaredNorm();
  }
  Calibrate();
}

// The rotation between two sets of vectors (Wahba 1965; by the singular value decomposition:
// Markley 1988), or the reflection where two axes were swapped. Whatever the bias: turns of a hand
// are larger.
std::optional<Eigen::Matrix3d> Gyroscope::BetterAxes() const {
  constexpr double kEnough = 40;     // comparisons
  constexpr double kMostLeft = 0.1;  // of the squared rotations
  // Of the turns about the first axis, those about the others: less is not told from noise.
  constexpr double kSecondAxis = 0.02, kThirdAxis = 0.003;
  if (is_trusted_ || compared_ < kEnough) return std::nullopt;
  double least = INFINITY;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  for (const Errors& candidate : errors_) {
    const SingularValues svd = SingularValuesOf(candidate.product);
    if (svd.values[1] < kSecondAxis * svd.values[0]) continue;
    // The third axis is that of a right-handed system unless the turns about it say otherwise.
    const bool is_third_known = svd.values[2] > kThirdAxis * svd.values[0];
    const Eigen::Vector3d signs(1, 1,
                                is_third_known ? 1 : (svd.u * svd.v.transpose()).determinant());
    const double left = of_images_ + candidate.of_samples - 2 * signs.dot(svd.values);
    if (left >= least) continue;
    least = left;
    axes = svd.u * signs.asDiagonal() * svd.v.transpose();
  }
  constexpr double kRight = 0.1;  // of the matrix: some degrees
  const bool are_others = (axes - Eigen::Matrix3d::Identity()).norm() > kRight;
  return least < kMostLeft * of_images_ && are_others ? std::optional(axes) : std::nullopt;
}

GyroscopeCalibration Gyroscope::calibration() const {
  GyroscopeCalibration known = calibration_;
  known.state = state();
  return known;
}

GyroscopeState Gyroscope::state() const {
  if (!is_trusted_) return GyroscopeState::kRefused;
  return calibration_.sigma_offset_s < kOffsetBefore / 2 &&
                 calibration_.sigma_bias < kBiasBefore / 2
             ? GyroscopeState::kCalibrated
             : GyroscopeState::kUnknown;
}

void Gyroscope::Calibrate() {
  const std::optional<GyroscopeCalibration> best = BestCalibration();
  constexpr double kMostSigma = 1 * kDegree;             // more tells less than the images before
  constexpr double kLeastAgreement = 0.5, kEnough = 20;  // comparisons
  // Trust comes back only where the images agree better than when it was lost, so that it does not
  // change from image to image.
  constexpr double kAgain = 0.7;
  const double share = is_trusted_ ? 1 : kAgain;
  is_trusted_ = best && best->sigma < share * kMostSigma &&
                (compared_ < kEnough || share * agreed_ > kLeastAgreement * compared_);
  if (best && best->sigma < kMostSigma) calibration_ = *best;
}

std::optional<GyroscopeCalibration> Gyroscope::BestCalibration() const {
  const double squared_duration =
      squared_duration_ + kSigmaBefore * kSigmaBefore / (kBiasBefore * kBiasBefore);
  // What least squares leave with the best bias for a candidate.
  const auto left = [&](ptrdiff_t i) {
    return errors_[i].squared - errors_[i].by_duration.squaredNorm() / squared_duration;
  };
  double variance = kSigmaBefore * kSigmaBefore;
  const auto cost = [&](ptrdiff_t i) {
    const double offset = OffsetOf(static_cast<double>(i)) / kOffsetBefore;
    return left(i) / variance + offset * offset;
  };
  ptrdiff_t best = 0;
  for (ptrdiff_t i = 1; i < kCandidates; ++i)
    if (cost(i) < cost(best)) best = i;
  // At an edge the offset that explains the images best may lie beyond.
  if (best == 0 || best == kCandidates - 1) return std::nullopt;
  constexpr double kLeastSigma = 0.05 * kDegree;  // since neither axes nor exposures are exact
  variance = std::max(kLeastSigma * kLeastSigma,
                      (left(best) + 3 * kCountBefore * variance) / (3 * (agreed_ + kCountBefore)));
  const double slope = (cost(best + 1) - cost(best - 1)) / 2,
               curvature = cost(best + 1) - 2 * cost(best) + cost(best - 1);  // by steps
  if (!(curvature > 0)) return std::nullopt;
  const double shift = std::clamp(-slope / curvature, -0.5, 0.5);
  // The errors change with the offset nearly linearly.
  const Errors &at = errors_[best], &next = errors_[shift > 0 ? best + 1 : best - 1];
  const Eigen::Vector3d by_duration =
      at.by_duration + std::abs(shift) * (next.by_duration - at.by_duration);
  return GyroscopeCalibration{by_duration / squared_duration,
                              std::sqrt(variance / squared_duration),
                              OffsetOf(static_cast<double>(best) + shift),
                              std::sqrt(2 / curvature) * kStep, std::sqrt(variance)};
}

}  // namespace oaslam
