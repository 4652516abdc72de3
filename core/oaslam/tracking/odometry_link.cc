#include "oaslam/tracking/odometry_link.h"

#include <algorithm>
#include <ranges>

#include "oaslam/map/motion_sigmas.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr double kYoung = 2;         // seconds, of a map
constexpr double kUnitSeconds = 10;  // the unit is averaged over these: its scale drifts slowly

// The length of the odometry's unit in units of the map: by key points with a landmark that lie
// beside a point whose depth the odometry knows.
std::optional<double> UnitBySharedPoints(const TrackedFrame& seen, const Map& map) {
  constexpr double kBeside = 3;  // pixels of the lowest level: mostly the same corner
  constexpr size_t kLeast = 10;
  const double radius = kBeside * seen.frame.features->pyramid.working_pixel();
  const auto x_of = [](const FrameMotion::KnownDepth& d) { return d.px.x(); };
  std::vector<FrameMotion::KnownDepth> depths = seen.frame.motion->depths;
  std::ranges::stable_sort(depths, {}, x_of);
  std::vector<double> lengths;
  for (size_t i = 0; i < seen.landmarks.size(); ++i) {
    const Landmark* landmark = map.landmarks.Find(seen.landmarks[i]);
    if (!landmark) continue;
    const Eigen::Vector2f& px = seen.frame.features->keypoints[i].px;
    const auto distance = [&](const auto& d) { return (d.px - px).squaredNorm(); };
    const auto near =
        std::ranges::subrange(std::ranges::lower_bound(depths, px.x() - radius, {}, x_of),
                              std::ranges::upper_bound(depths, px.x() + radius, {}, x_of));
    const auto beside = std::ranges::min_element(near, {}, distance);
    if (beside == near.end() || distance(*beside) > radius * radius) continue;
    lengths.push_back((seen.cam_from_world * landmark->position).z() *
                      static_cast<double>(beside->inverse_depth));
  }
  if (lengths.size() < kLeast) return std::nullopt;
  const double length = Median(std::move(lengths));
  return length > 0 ? std::optional(length) : std::nullopt;
}

}  // namespace

double MedianDepthOf(const FrameMotion& motion, float above) {
  std::vector<double> inverse;
  for (const FrameMotion::KnownDepth& d : motion.depths)
    if (d.inverse_depth > above) inverse.push_back(d.inverse_depth);
  return inverse.empty() ? 0 : 1 / Median(std::move(inverse));
}

void OdometryLink::Begin(const Frame& frame, KeyframeId keyframe, double depth) {
  unit_ = Unit{frame.motion->run, 0, 1, kUnitSeconds};
  starts_ = {{frame.motion, keyframe, {}}};
  keyframes_ = {{keyframe, frame.motion}};
  map_began_at_ = seen_at_ = frame.timestamp;
  depth_ = depth;
}

void OdometryLink::See(const TrackedFrame& seen, double depth, const Map& map,
                       const TrackedFrame* before) {
  Learn(seen, map, before);
  starts_ = {{seen.frame.motion, seen.reference, seen.cam_from_reference}};
  seen_at_ = seen.frame.timestamp;
  depth_ = depth;
}

void OdometryLink::AddKeyframe(KeyframeId id, const Frame& frame) {
  constexpr size_t kMost = 30;  // the odometry's window mostly has fewer of these keyframes
  starts_.push_back({frame.motion, id, {}});
  keyframes_.emplace_back(id, frame.motion);
  if (keyframes_.size() > kMost) keyframes_.erase(keyframes_.begin());
}

std::optional<KeyframeId> OdometryLink::Correct(const Frame& frame) {
  for (const auto& [id, motion] : keyframes_ | std::views::reverse) {
    if (!motion || motion->run != frame.motion->run) return std::nullopt;
    if (motion->image > *frame.motion->exchanged_since) continue;
    starts_ = {{motion, id, {}}};
    return id;
  }
  return std::nullopt;
}

void OdometryLink::Scale(double factor) {
  for (Start& start : starts_) start.cam_from_reference.translation *= factor;
  if (unit_) unit_->length *= factor;
  if (metre_) metre_->log_sum -= metre_->weight * std::log(factor);
  depth_ *= factor;
}

void OdometryLink::Scale(const std::map<KeyframeId, double>& factors) {
  for (Start& start : starts_)
    if (const auto found = factors.find(start.reference); found != factors.end())
      start.cam_from_reference.translation *= found->second;
}

bool OdometryLink::IsYoung(double timestamp) const { return timestamp - map_began_at_ < kYoung; }

// In a map that is only read, the error grows until the map is found again.
bool OdometryLink::IsTooLongAgo(double timestamp, MapUse use) const {
  constexpr double kMaxUnmapped = 5;  // seconds
  return use == MapUse::kRead && std::abs(timestamp - seen_at_) > kMaxUnmapped;
}

// While the odometry does not know how far the camera has moved, it still knows how it has turned.
// `newest` tells the motions as the odometry knows them by now.
std::optional<MotionInMap> OdometryLink::MotionBetween(
    const std::shared_ptr<const FrameMotion>& before, const std::shared_ptr<const FrameMotion>& now,
    const Frame& newest) const {
  if (!before || !now || before->run != now->run || newest.motion->run != now->run)
    return std::nullopt;
  MotionInMap motion;
  motion.cam_from_cam =
      CamFromOdom(*now, *newest.motion).value_or(now->cam_from_odom) *
      CamFromOdom(*before, *newest.motion).value_or(before->cam_from_odom).Inverse();
  motion.is_turn = !HaveKnownMotion(before, now) || !unit_ || unit_->run != now->run;
  if (motion.is_turn) {
    motion.cam_from_cam.translation.setZero();
    motion.sigma_position = kUnknownWay * depth_;
  } else {
    if (metre_ && before->metre && now->metre) {
      const MeasuredMetre metre = newest.motion->metre.value_or(*now->metre);
      motion.metres = metre.metres_per_unit * motion.cam_from_cam.translation.norm();
      motion.relative_sigma = metre.relative_sigma;
    }
    motion.cam_from_cam.translation *= unit_->length;
    motion.sigma_position =
        std::max(kSigmaOfWay, unit_->spread) * motion.cam_from_cam.translation.norm() +
        (IsYoung(newest.timestamp) ? kSigmaOfDepthIfYoung : kSigmaOfDepth) * unit_->length *
            MedianDepthOf(*now);
  }
  // Where the way is not known, part of what looks like a turn may be a way.
  const double least_turn = motion.is_turn ? kUnknownWay : kLeastTurn;
  motion.sigma_rotation =
      kSigmaOfTurn * Eigen::AngleAxisd(Eigen::Quaterniond(motion.cam_from_cam.rotation)).angle() +
      least_turn;
  return motion;
}

std::optional<MotionInMap> OdometryLink::MotionSince(
    const std::shared_ptr<const FrameMotion>& before, const Frame& frame) const {
  return frame.motion ? MotionBetween(before, frame.motion, frame) : std::nullopt;
}

std::optional<MotionInMap> OdometryLink::MotionSinceKeyframe(const Frame& frame) const {
  return keyframes_.empty() ? std::nullopt : MotionSince(keyframes_.back().second, frame);
}

std::vector<std::pair<KeyframeId, KeyframeMotion>> OdometryLink::MotionsToKeyframes(
    const Frame& frame) const {
  std::vector<std::pair<KeyframeId, KeyframeMotion>> motions;
  for (size_t i = 1; i < keyframes_.size(); ++i) {
    const auto& [from, before] = keyframes_[i - 1];
    const auto& [to, now] = keyframes_[i];
    const bool is_newest = i + 1 == keyframes_.size();
    if (!before || !frame.motion || (!is_newest && !CamFromOdom(*before, *frame.motion))) continue;
    const auto motion = MotionBetween(before, now, frame);
    if (motion && !motion->is_turn)
      motions.push_back(
          {to, KeyframeMotion{from, motion->cam_from_cam, motion->sigma_position,
                              motion->sigma_rotation, motion->metres, motion->relative_sigma}});
  }
  return motions;
}

std::optional<OdometryPrediction> OdometryLink::Predict(const Frame& frame, const Map& map,
                                                        MapUse use) const {
  for (const Start& start : starts_ | std::views::reverse) {
    const auto carried = map.ResolveKeyframe(start.reference);
    const auto motion = carried ? MotionSince(start.motion, frame) : std::nullopt;
    const double seconds = std::abs(frame.timestamp - seen_at_);
    // Seconds without knowing how far the camera has moved.
    constexpr double kMaxTurning = 1;
    if (!motion || (motion->is_turn && seconds > kMaxTurning) || IsTooLongAgo(frame.timestamp, use))
      continue;
    return OdometryPrediction{
        {motion->cam_from_cam * start.cam_from_reference * carried->cam_from_carrier *
             map.keyframes.At(carried->by).cam_from_world,
         (1 + seconds) * motion->sigma_position, (1 + seconds) * motion->sigma_rotation},
        carried->by,
        motion->is_turn,
        unit_ ? unit_->length * MedianDepthOf(*frame.motion) : 0};
  }
  return std::nullopt;
}

bool OdometryLink::CanCarry(double timestamp, const FrameMotion* motion, MapUse use) const {
  // A new map needs all the keyframes that it can get (docs/lab/odometry.md).
  if (!unit_ || IsYoung(timestamp) || IsTooLongAgo(timestamp, use)) return false;
  return !motion || !(motion->is_preliminary || motion->is_keyframe || motion->run != unit_->run);
}

std::optional<double> OdometryLink::UnitFor(const Frame& frame) const {
  return unit_ && frame.motion && unit_->run == frame.motion->run ? std::optional(unit_->length)
                                                                  : std::nullopt;
}

std::optional<MeasuredMetre> OdometryLink::metre() const {
  if (!metre_) return std::nullopt;
  return MeasuredMetre{metre_->length(), metre_->relative_sigma, metre_->source};
}

void OdometryLink::Learn(const TrackedFrame& seen, const Map& map, const TrackedFrame* before) {
  LearnUnit(seen, map, before);
  const std::shared_ptr<const FrameMotion>& motion = seen.frame.motion;
  if (!motion || !motion->metre || !unit_ || unit_->run != motion->run) return;
  LearnMetre(*motion, before ? seen.frame.timestamp - before->frame.timestamp : 0);
}

// Of a unit in metres the sensor knows where the map has another scale than before.
void OdometryLink::LearnMetre(const FrameMotion& motion, double seconds) {
  constexpr double kMostOff = 0.04;  // of the unit: the errors of both
  constexpr double kLeastSeconds = 1e-3;
  const MeasuredMetre& measured = *motion.metre;
  if (!metre_ || metre_->source != measured.source) metre_.emplace();
  const double weight =
      std::clamp(seconds, kLeastSeconds, 1.0) / (measured.relative_sigma * measured.relative_sigma);
  metre_->relative_sigma = measured.relative_sigma;
  metre_->source = measured.source;
  metre_->log_sum += weight * std::log(measured.metres_per_unit / unit_->length);
  metre_->weight += weight;
  const double by_metre = measured.metres_per_unit / metre_->length(),
               most = std::exp(std::max(kMostOff, 2 * measured.relative_sigma));
  unit_->length = std::clamp(unit_->length, by_metre / most, by_metre * most);
}

void OdometryLink::LearnUnit(const TrackedFrame& seen, const Map& map, const TrackedFrame* before) {
  const Frame& frame = seen.frame;
  const auto length = frame.motion ? UnitBySharedPoints(seen, map) : std::nullopt;
  if (!length) return;
  if (!before || !unit_ || unit_->run != frame.motion->run || unit_->loops != map.loops_closed) {
    unit_ = Unit{frame.motion->run, map.loops_closed, *length};
    return;
  }
  const double elapsed = std::abs(frame.timestamp - before->frame.timestamp);
  unit_->seconds = std::min(kUnitSeconds, unit_->seconds + elapsed);
  if (unit_->seconds <= 0) return;
  const double off = std::log(*length / unit_->length);
  unit_->length *= std::exp(off * std::min(1.0, elapsed / unit_->seconds));
  unit_->spread_seconds = std::min(kUnitSeconds, unit_->spread_seconds + elapsed);
  unit_->spread += (std::abs(off) - unit_->spread) * std::min(1.0, elapsed / unit_->spread_seconds);
}

}  // namespace oaslam
