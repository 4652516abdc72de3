#include "oaslam/tracking/initializer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <ranges>
#include <utility>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/estimation/two_view.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/util/log.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// The farthest that key points may move between two images, as a share of the focal length: a
// rotation of about eleven degrees. A wider window finds more wrong matches.
constexpr double kWindow = 0.2;
// Of descriptor distances; loose, since the two-view estimate rejects wrong matches.
constexpr double kMatchRatio = 0.9;
constexpr size_t kMaxReferences = 4;  // each costs one matching per image
// A new reference begins once the newest one keeps less than this share of its first matches.
constexpr double kLostShare = 0.7;
// 10 s at 30 Hz, since a camera that turns waits for long; a frame takes about 50 KB.
constexpr size_t kMaxRecent = 300;
// Matches between the two views of a map where corners are many; the first map has hardly more
// landmarks.
constexpr int kInitialMatches = 100;
// Seconds between two attempts with a reference, since parallax grows slowly.
constexpr double kBetweenTries = 0.05;
// Pixels of the lowest level; with less median motion the camera counts as still, since such motion
// is hardly above the error of key points.
constexpr double kStillPixels = 3;

// Gives a frame the pose that the odometry has found for it in the meantime.
void Revise(const FrameMotion& newest, Frame& frame) {
  if (!frame.motion || frame.motion->run != newest.run) return;
  const auto found =
      std::ranges::find(newest.keyframes, frame.motion->image, &std::pair<int, Rigid3>::first);
  if (found == newest.keyframes.end()) return;
  auto motion = std::make_shared<FrameMotion>(*frame.motion);
  motion->cam_from_odom = found->second;
  motion->keyframes.assign(newest.keyframes.begin(), std::next(found));
  motion->is_preliminary = false;
  frame.motion = std::move(motion);
}

// The pose of an image before the map, in the frame of the odometry as it is known with image
// `now`: between the images before and after it whose poses were corrected, or as it was given
// relative to the nearest of them.
Rigid3 CorrectedPose(const FrameMotion& image, const std::vector<Frame>& frames,
                     const FrameMotion& now) {
  const auto after =
      std::ranges::lower_bound(now.keyframes, image.image, {}, &std::pair<int, Rigid3>::first);
  if (after == now.keyframes.end()) return image.cam_from_odom;
  if (after->first == image.image) return after->second;
  if (after != now.keyframes.begin()) {
    const auto& [first, from] = *std::prev(after);
    const Rigid3& to = after->second;
    const double share = (image.image - first) / static_cast<double>(after->first - first);
    const auto rotation = from.rotation.slerp(share, to.rotation);
    const Eigen::Vector3d center =
        from.OriginInSource() + share * (to.OriginInSource() - from.OriginInSource());
    return Rigid3(rotation, rotation * -center);
  }
  for (const Frame& frame : frames)
    if (frame.motion && frame.motion->run == now.run && frame.motion->image == after->first)
      return image.cam_from_odom * frame.motion->cam_from_odom.Inverse() * after->second;
  return image.cam_from_odom;
}

// A map whose first keyframe measured the depths of its key points; nothing where fewer than
// `least` of them have one that fits both images.
std::optional<InitialMap> MeasuredMap(const Frame& first, const Frame& second, const Rigid3& motion,
                                      const KeypointPairs& pairs, int least) {
  const std::optional<MeasuredMetre>& metre = second.motion->metre;
  if (!first.depth || !metre || metre->source != UnitSource::kDepth) return std::nullopt;
  InitialMap map{first, second, {}, {}, motion, {}, second.motion->cam_from_odom, motion, true};
  for (const auto& [a, b] : pairs) {
    const Eigen::Vector2d px = first.features->keypoints[a].px.cast<double>();
    const auto depth = first.depth->At(Distort(*first.camera, px));
    if (!depth) continue;
    const Eigen::Vector3d ray = RayOf(*first.camera, px),
                          point = depth->z / metre->metres_per_unit / ray.z() * ray,
                          there = motion * point;
    const Keypoint& seen = second.features->keypoints[b];
    const double sigma = second.features->pyramid.scale[seen.octave];
    if (there.z() > 0 &&
        (ProjectIdeal(*second.camera, there) - seen.px.cast<double>()).squaredNorm() <
            kChi2TwoDof * sigma * sigma)
      map.points.push_back({a, b, point});
  }
  return std::ssize(map.points) < least ? std::nullopt : std::optional(std::move(map));
}

}  // namespace

std::vector<Frame> Initializer::Reset() {
  references_.clear();
  const std::deque<Frame> recent = std::exchange(recent_, {});
  return {recent.begin(), recent.end()};
}

int Initializer::NeededMatches(const Frame& frame) const {
  // An eighth of the key points: where corners are few, fewer matches can be asked.
  constexpr int kFewest = 40, kShare = 8;
  return std::clamp(frame.features->size() / kShare, kFewest, kInitialMatches);
}

KeypointPairs Initializer::Follow(Reference& reference, const Frame& frame) const {
  KeypointPairs pairs =
      MatchWithinWindow(*reference.frame.features, *frame.features, reference.last_seen,
                        kWindow * frame.camera->fx, kMatchRatio);
  for (const auto& [a, b] : pairs)
    reference.last_seen[a] = frame.features->keypoints[b].px.cast<double>();
  reference.matches = static_cast<int>(pairs.size());
  reference.first_matches = std::max(reference.first_matches, reference.matches);
  return pairs;
}

std::optional<InitialMap> Initializer::Try(const Reference& reference, const Frame& frame,
                                           const KeypointPairs& pairs) {
  const Rigid3 motion =
      frame.motion->cam_from_odom * CamFromOdom(*reference.frame.motion, *frame.motion)
                                        .value_or(reference.frame.motion->cam_from_odom)
                                        .Inverse();
  if (auto map = MeasuredMap(reference.frame, frame, motion, pairs, NeededMatches(frame) / 2))
    return map;
  const Features &first = *reference.frame.features, &second = *frame.features;
  std::vector<Eigen::Vector2d> in_first, in_second;
  std::vector<double> sigma, moved;
  for (const auto& [a, b] : pairs) {
    in_first.push_back(first.keypoints[a].px.cast<double>());
    in_second.push_back(second.keypoints[b].px.cast<double>());
    sigma.push_back(std::hypot(first.pyramid.scale[first.keypoints[a].octave],
                               second.pyramid.scale[second.keypoints[b].octave]) /
                    std::sqrt(2));
    moved.push_back((in_first.back() - in_second.back()).norm());
  }
  if (Median(std::move(moved)) < kStillPixels * second.pyramid.working_pixel()) {
    why_not_ = "the camera has not moved";
    return std::nullopt;
  }
  // Between the rays of at least half of the matches; below it depth is uncertain
  // (docs/lab/tracking.md).
  constexpr double kMinParallaxDeg = 2;
  TwoViewOptions options;
  options.min_parallax_deg = kMinParallaxDeg;
  options.min_points = NeededMatches(frame) / 2;
  const TwoViewReport report = TriangulateTwoViews(*reference.frame.camera, *frame.camera, in_first,
                                                   in_second, sigma, motion, options);
  if (!report.success) {
    why_not_ = report.parallax_deg < options.min_parallax_deg
                   ? "the camera only turned, or all it sees is far away"
                   : report.why_not;
    return std::nullopt;
  }
  Log(LogLevel::kDebug,
      "map begun from frames {} and {}: {} matches, {} inliers, {} points, parallax "
      "{:.1f} degrees, direction +- {:.1f} degrees",
      reference.frame.index, frame.index, pairs.size(), report.inliers, report.triangulated,
      report.parallax_deg, report.direction_sigma_deg);
  InitialMap map{
      reference.frame, frame, {}, {}, report.second_from_first, {}, frame.motion->cam_from_odom,
      motion};
  for (size_t i = 0; i < pairs.size(); ++i)
    if (report.points[i])
      map.points.push_back({pairs[i].first, pairs[i].second, *report.points[i]});
  return map;
}

std::optional<InitialMap> Initializer::Process(const Frame& frame) {
  const int needed = NeededMatches(frame);
  const bool is_known = frame.motion && !frame.motion->is_preliminary;
  if (frame.features->size() < needed)
    why_not_ = "too few corners in the image";
  else if (!is_known)
    why_not_ = "the motion is not clear yet";
  if (is_known)
    for (Reference& reference : references_) Revise(*frame.motion, reference.frame);
  std::optional<InitialMap> map;
  for (Reference& reference : references_) {
    const KeypointPairs pairs = Follow(reference, frame);
    const bool is_due =
        !reference.last_try || frame.timestamp - *reference.last_try > kBetweenTries;
    if (map || !is_due || reference.matches < needed ||
        !HaveKnownMotion(reference.frame.motion, frame.motion))
      continue;
    map = Try(reference, frame, pairs);
    reference.last_try = frame.timestamp;
  }
  if (map) return map;
  // Once the odometry knows the motion, a reference of which it does not is of no use.
  std::erase_if(references_, [&](const Reference& r) {
    return r.matches < needed || (is_known && !HaveKnownMotion(r.frame.motion, frame.motion));
  });
  const bool begins = references_.empty() ||
                      references_.back().matches < kLostShare * references_.back().first_matches;
  // The poses of other images are not revised.
  const bool is_useful = is_known || (frame.motion && frame.motion->is_keyframe);
  if (begins && is_useful && frame.features->size() >= needed) {
    if (references_.size() == kMaxReferences) references_.pop_front();
    Reference reference{frame, {}, 0, 0};
    for (const Keypoint& k : frame.features->keypoints)
      reference.last_seen.push_back(k.px.cast<double>());
    references_.push_back(std::move(reference));
  }
  recent_.push_back(frame);
  recent_.back().image.reset();
  recent_.back().depth.reset();
  if (recent_.size() > kMaxRecent) recent_.pop_front();
  return std::nullopt;
}

std::vector<FrameBeforeMap> PlaceFramesBeforeMap(const std::vector<Frame>& frames, const Map& map,
                                                 KeyframeId first, const FrameMotion& now,
                                                 double depth, const TrackDemands& demands) {
  constexpr double kWindow = 30;  // pixels of the lowest level
  // A map of two keyframes tells little: shares of the way from the first one and of the depth;
  // rad.
  constexpr double kOfWay = 0.15, kOfDepth = 0.02, kTurn = 0.02;
  const Keyframe& keyframe = map.keyframes.At(first);
  std::vector<FrameBeforeMap> placed;
  const auto place = [&](auto&& some) {
    std::shared_ptr<const Features> features = keyframe.features;
    std::vector<LandmarkId> landmarks = keyframe.landmarks;
    bool is_tracked = true;
    for (const Frame& frame : some) {
      if (!frame.motion || frame.motion->run != now.run) continue;
      const Rigid3 expected = CorrectedPose(*frame.motion, frames, now);
      TrackReport report;
      if (is_tracked)
        report = TrackFromLastFrame(frame, map, *features, landmarks, expected, kWindow);
      if (report.success) report = TrackLocalMap(frame, map, report, demands);
      const PoseVector off = StepOf(report.cam_from_world * expected.Inverse());
      const double way =
          (expected.OriginInSource() - keyframe.cam_from_world.OriginInSource()).norm();
      report.success = report.success && off.head<3>().norm() < kOfWay * way + kOfDepth * depth &&
                       off.tail<3>().norm() < kTurn;
      if (report.success) {
        features = frame.features;
        landmarks = report.landmarks;
      } else {
        if (frame.index < keyframe.frame_index) is_tracked = false;
        report.cam_from_world = expected;
        report.landmarks.clear();
      }
      placed.push_back({frame,
                        {frame.index, frame.timestamp, first,
                         report.cam_from_world * keyframe.cam_from_world.Inverse(),
                         report.success ? TrackingState::kTracking : TrackingState::kPreliminary},
                        std::move(report.landmarks)});
    }
  };
  place(frames |
        std::views::filter([&](const Frame& frame) { return frame.index > keyframe.frame_index; }));
  place(frames | std::views::reverse |
        std::views::filter([&](const Frame& frame) { return frame.index < keyframe.frame_index; }));
  return placed;
}

}  // namespace oaslam
