#include "oaslam/tracking/following.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "oaslam/geometry/pose_step.h"
#include "oaslam/matching/projection_search.h"

namespace oaslam {
namespace {

// With fewer landmarks in view, the camera may soon be lost, and the pose is strengthened by
// matches of all key points with the last image.
constexpr int kFewLandmarks = 200;
// The smallest search radius about a prediction, pixels of the lowest level.
constexpr double kMotionWindow = 15;

// Tracks in the local map from a first pose. Where few landmarks are in view, matches with the last
// image strengthen the result.
TrackReport StrengthenedInLocalMap(const Frame& frame, const Map& map, const TrackedFrame& last,
                                   const TrackReport& first, const TrackDemands& demands) {
  TrackReport report = first.success ? TrackLocalMap(frame, map, first, demands) : TrackReport{};
  const auto reference = map.ResolvePose(last.reference);
  if (report.success && report.inliers < kFewLandmarks && reference)
    report = StrengthenByMatches(frame, map, *last.frame.features,
                                 last.cam_from_reference * *reference, report, demands);
  return report;
}

// What a keyframe saw; where that is little, also what those before it saw.
std::vector<LandmarkId> LandmarksBefore(const Map& map, KeyframeId id) {
  constexpr int kMostKeyframes = 20;  // some seconds
  std::vector<LandmarkId> landmarks;
  for (int i = 0; i < kMostKeyframes && landmarks.size() < kFewLandmarks; ++i) {
    const Keyframe& keyframe = map.keyframes.At(id);
    std::ranges::copy_if(keyframe.landmarks, std::back_inserter(landmarks),
                         [](LandmarkId landmark) { return landmark.IsValid(); });
    const auto before = keyframe.motion ? map.ResolveKeyframe(keyframe.motion->from) : std::nullopt;
    if (!before) break;
    id = before->by;
  }
  return landmarks;
}

TrackReport ByMotionAlone(const OdometryPrediction& predicted) {
  TrackReport report;
  report.cam_from_world = predicted.expected.cam_from_world;
  report.covariance = predicted.expected.Covariance();
  report.reference = predicted.reference;
  report.depth = predicted.depth;
  return report;
}

}  // namespace

TrackReport FollowMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                         const OdometryPrediction& predicted, const TrackDemands& demands) {
  constexpr double kSigmas = 5;
  const ExpectedPose& expected = predicted.expected;
  const auto agrees = [&](const TrackReport& report) {
    const PoseVector off = StepOf(report.cam_from_world * expected.cam_from_world.Inverse());
    return report.inliers >= kFewLandmarks ||
           (off.head<3>().norm() < kSigmas * expected.sigma_position &&
            off.tail<3>().norm() < kSigmas * expected.sigma_rotation);
  };
  for (const double radius : {kMotionWindow, 3 * kMotionWindow}) {
    const TrackReport report =
        StrengthenedInLocalMap(frame, map, last,
                               TrackFromLastFrame(frame, map, *last.frame.features, last.landmarks,
                                                  expected.cam_from_world, radius),
                               demands);
    if (report.success && agrees(report)) return report;
  }
  TrackReport report =
      TrackByPrior(frame, map, expected, LandmarksBefore(map, predicted.reference), demands);
  if (!agrees(report)) {  // landmarks of a place that looks alike
    report = ByMotionAlone(predicted);
    report.landmarks.resize(frame.features->size());
  }
  if (report.success) return report;
  report.reference = predicted.reference;
  if (!(report.depth > 0)) report.depth = predicted.depth;
  return report;
}

TrackReport FollowWithoutMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                                const TrackDemands& demands) {
  const std::optional<Rigid3> reference = map.ResolvePose(last.reference);
  if (!reference) return {};
  const Rigid3 last_pose = last.cam_from_reference * *reference;
  for (const double times : {1, 2, 4, 8}) {
    const TrackReport found =
        StrengthenedInLocalMap(frame, map, last,
                               TrackFromLastFrame(frame, map, *last.frame.features, last.landmarks,
                                                  last_pose, times * kMotionWindow),
                               demands);
    if (found.success) return found;
  }
  return {};
}

TrackReport CarryByMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                          const OdometryPrediction& predicted, Features& features) {
  TrackReport carried = ByMotionAlone(predicted);
  const Features& before = *last.frame.features;
  for (size_t i = 0; i < last.landmarks.size(); ++i) {
    const LandmarkId id = last.landmarks[i];
    const Landmark* landmark = map.landmarks.Find(id);
    const auto seen =
        landmark ? ProjectLandmark(id, *landmark, *frame.camera, carried.cam_from_world, before)
                 : std::nullopt;
    if (!seen) continue;
    features.keypoints.push_back(before.keypoints[i]);
    features.keypoints.back().px = seen->px.cast<float>();
    features.descriptors.push_back(before.descriptors[i]);
    carried.landmarks.push_back(id);
  }
  carried.matched = carried.inliers = features.size();
  return carried;
}

}  // namespace oaslam
