#include "oaslam/tracking/pose_tracking.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "oaslam/estimation/pose_by_matches.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/matching/projection_search.h"
#include "oaslam/util/id_set.h"

namespace oaslam {
namespace {

// A first pose needs few inliers, since TrackLocalMap finds more landmarks and decides.
constexpr int kMinMatches = 20, kMinFirstInliers = 10;
// Pixels of the lowest level; small, since the first pose is refined already.
constexpr double kLocalRadius = 4;
// Bounds the landmarks to project, and so the time for an image.
constexpr int kMaxLocalKeyframes = 40;

double Spread(const PoseReport& pose, const MatchedPoints& matched, const Camera& camera) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (size_t i = 0; i < matched.observations.size(); ++i) {
    if (!pose.inlier[i]) continue;
    const Eigen::Vector2d place =
        matched.observations[i].px.cwiseQuotient(Eigen::Vector2d(camera.width, camera.height));
    sum += place;
    squares += place * place.transpose();
  }
  if (pose.inliers == 0) return 0;
  const Eigen::Vector2d mean = sum / pose.inliers;
  const SymmetricEigen<2> eigen =
      EigenOfSymmetric(Eigen::Matrix2d(squares / pose.inliers - mean * mean.transpose()));
  return pose.inliers * std::max(0.0, eigen.values(0));
}

TrackReport Report(const Camera& camera, const Map& map, const PoseReport& pose,
                   const MatchedPoints& matched, const std::vector<LandmarkId>& matches,
                   int min_inliers) {
  TrackReport report;
  report.landmarks.resize(matches.size());
  report.matched = static_cast<int>(matched.keypoints.size());
  if (!pose.success) return report;
  report.cam_from_world = pose.cam_from_world;
  for (size_t i = 0; i < matched.keypoints.size(); ++i)
    if (pose.inlier[i]) report.landmarks[matched.keypoints[i]] = matches[matched.keypoints[i]];
  report.inliers = pose.inliers;
  report.depth = map.MedianDepth(pose.cam_from_world, report.landmarks);
  report.spread = Spread(pose, matched, camera);
  report.covariance = pose.covariance;
  report.relative_sigma = report.depth > 0 ? SigmaOfPosition(pose.covariance) / report.depth : 1;
  report.success = pose.inliers >= min_inliers;
  return report;
}

// Refines the pose on the matches and keeps the inliers.
TrackReport Refine(const Frame& frame, const Map& map, const Rigid3& initial,
                   const std::vector<LandmarkId>& matches, int min_inliers,
                   const std::optional<ExpectedPose>& prior = std::nullopt) {
  const MatchedPoints matched = ObserveMatches(*frame.features, map, matches);
  const Camera& camera = *frame.camera;
  return Report(camera, map, RefinePose(camera, initial, matched.observations, prior), matched,
                matches, min_inliers);
}

bool Meets(const TrackReport& report, const TrackDemands& demands) {
  constexpr double kMostOfMatched = 0.5;  // TrackDemands::least_inliers
  if (report.inliers < demands.least_inliers || !(report.relative_sigma < demands.relative_sigma) ||
      report.spread < demands.spread)
    return false;
  const double matched = report.matched, expected = static_cast<double>(report.visible.size());
  if (report.inliers < demands.agreement * std::sqrt(matched * expected)) return false;
  return report.inliers >= demands.inliers || report.inliers > kMostOfMatched * report.matched;
}

// Searches for the landmarks of a local map near their projections. `matched`: by key point, what
// was found already.
TrackReport TrackIn(const LocalMap& local, const Frame& frame, const Map& map, const Rigid3& start,
                    const std::vector<LandmarkId>& matched,
                    const std::optional<ExpectedPose>& prior, const TrackDemands& demands) {
  std::vector<LandmarkId> visible;
  for (const LandmarkId id : matched)
    if (id.IsValid()) visible.push_back(id);
  std::vector<LandmarkId> known = visible;
  std::ranges::sort(known);
  std::vector<ProjectedLandmark> projected;
  for (const LandmarkId id : local.landmarks) {
    if (std::ranges::binary_search(known, id)) continue;
    if (const auto p =
            ProjectLandmark(id, map.landmarks.At(id), *frame.camera, start, *frame.features))
      projected.push_back(*p);
  }
  ProjectionSearchOptions options;
  options.radius_px = kLocalRadius * demands.radius_scale;
  const LandmarkMatches matches =
      SearchByProjection(*frame.features, map, projected, matched, options);
  for (const ProjectedLandmark& p : projected) visible.push_back(p.id);

  TrackReport report = Refine(frame, map, start, matches.landmarks, 0, prior);
  report.visible = std::move(visible);
  report.success = Meets(report, demands);
  if (report.success || prior) report.reference = local.keyframes.front();
  return report;
}

// Matches key points with the previous image, around where they would be if all were at `depth`.
KeypointPairs MatchAtDepth(const Frame& frame, const Frame& last, const Rigid3& cam_from_before,
                           double depth, double radius) {
  // Loose, since the robust kernel of the refinement outweighs wrong matches.
  constexpr double kRatio = 0.9;
  const Eigen::Vector2d nowhere = Eigen::Vector2d::Constant(-1e6);
  std::vector<Eigen::Vector2d> expected;
  for (const Keypoint& k : last.features->keypoints) {
    const Eigen::Vector3d p = cam_from_before * (depth * RayOf(*last.camera, k.px.cast<double>()));
    expected.push_back(p.z() > 0 ? ProjectIdeal(*frame.camera, p) : nowhere);
  }
  return MatchWithinWindow(*last.features, *frame.features, expected,
                           radius * frame.features->pyramid.working_pixel(), kRatio);
}

EpipolarMatch ToMatch(const Frame& before, const Frame& now, const std::pair<int, int>& pair) {
  const Keypoint &first = before.features->keypoints[pair.first],
                 &second = now.features->keypoints[pair.second];
  const double sigma = std::hypot(before.features->pyramid.scale[first.octave],
                                  now.features->pyramid.scale[second.octave]) /
                       std::sqrt(2);
  return {RayOf(*before.camera, first.px.cast<double>()),
          RayOf(*now.camera, second.px.cast<double>()), sigma};
}

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
    report = StrengthenByMatches(frame, map, last.frame, last.cam_from_reference * *reference,
                                 report, demands);
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

}  // namespace

TrackReport ByMotionAlone(const OdometryPrediction& predicted) {
  TrackReport report;
  report.cam_from_world = predicted.expected.cam_from_world;
  report.covariance = predicted.expected.Covariance();
  report.reference = predicted.reference;
  report.depth = predicted.depth;
  return report;
}

TrackReport TrackFromLastFrame(const Frame& frame, const Map& map, const Features& last_features,
                               const std::vector<LandmarkId>& last_landmarks,
                               const Rigid3& predicted, double radius) {
  const LandmarkMatches matches = SearchFromLastFrame(*frame.features, *frame.camera, predicted,
                                                      map, last_features, last_landmarks, radius);
  if (matches.count < kMinMatches) return {};
  return Refine(frame, map, predicted, matches.landmarks, kMinFirstInliers);
}

TrackReport TrackLocalMap(const Frame& frame, const Map& map, const TrackReport& initial,
                          const TrackDemands& demands) {
  const LocalMap local = CollectLocalMap(map, initial.landmarks, kMaxLocalKeyframes);
  if (!local.keyframes.empty())
    return TrackIn(local, frame, map, initial.cam_from_world, initial.landmarks, {}, demands);
  TrackReport report = initial;
  report.success = false;
  return report;
}

TrackReport TrackByPrior(const Frame& frame, const Map& map, const ExpectedPose& prior,
                         std::span<const LandmarkId> around, const TrackDemands& demands) {
  const std::vector<LandmarkId> none(frame.features->keypoints.size());
  const LocalMap local = CollectLocalMap(map, around, kMaxLocalKeyframes);
  if (!local.keyframes.empty())
    return TrackIn(local, frame, map, prior.cam_from_world, none, prior, demands);
  TrackReport report;
  report.cam_from_world = prior.cam_from_world;
  report.covariance = prior.Covariance();
  report.landmarks = none;
  return report;
}

TrackReport StrengthenByMatches(const Frame& frame, const Map& map, const Frame& before,
                                const Rigid3& before_from_world, const TrackReport& tracked,
                                const TrackDemands& demands) {
  // Search radius in pixels of the lowest level: how far a point's actual depth may move it between
  // two images.
  constexpr double kRadius = 40;
  const Camera& camera = *frame.camera;
  if (!(tracked.depth > 0)) return tracked;
  const Rigid3 cam_from_before = tracked.cam_from_world * before_from_world.Inverse();
  std::vector<EpipolarMatch> matches;
  for (const auto& pair : MatchAtDepth(frame, before, cam_from_before, tracked.depth, kRadius))
    if (!tracked.landmarks[pair.second]
             .IsValid())  // a landmark constrains the pose better than such a match
      matches.push_back(ToMatch(before, frame, pair));
  const MatchedPoints matched = ObserveMatches(*frame.features, map, tracked.landmarks);
  const PoseReport pose = RefinePoseByMatches(camera, tracked.cam_from_world, matched.observations,
                                              before_from_world, matches);
  TrackReport report = Report(camera, map, pose, matched, tracked.landmarks, 0);
  report.matched = tracked.matched;
  report.reference = tracked.reference;
  report.visible = tracked.visible;
  report.success = Meets(report, demands);
  return report;
}

LocalMap CollectLocalMap(const Map& map, std::span<const LandmarkId> matched, int max_keyframes) {
  std::vector<KeyframeId> observers;
  for (const LandmarkId id : matched)
    if (const Landmark* landmark = map.landmarks.Find(id))
      for (const Observation& o : landmark->observations) observers.push_back(o.keyframe);
  std::ranges::sort(observers);
  std::vector<Covisible> votes;
  for (const KeyframeId id : observers) {
    if (votes.empty() || votes.back().keyframe != id) votes.push_back({id, 0});
    ++votes.back().shared;
  }
  std::ranges::stable_sort(
      votes, [](const Covisible& a, const Covisible& b) { return a.shared > b.shared; });

  LocalMap local;
  const auto add = [&](KeyframeId id) {
    if (static_cast<int>(local.keyframes.size()) < max_keyframes &&
        std::ranges::find(local.keyframes, id) == local.keyframes.end())
      local.keyframes.push_back(id);
  };
  for (const Covisible& vote : votes) add(vote.keyframe);
  const size_t direct = local.keyframes.size();
  for (size_t i = 0; i < direct && static_cast<int>(local.keyframes.size()) < max_keyframes; ++i)
    // Five each: the voting keyframes already have most of the landmarks in view.
    for (const KeyframeId neighbour : map.CovisibleKeyframes(local.keyframes[i], 5)) add(neighbour);

  IdSet<LandmarkId> listed;
  for (const KeyframeId id : local.keyframes)
    for (const LandmarkId landmark : map.keyframes.At(id).landmarks)
      if (landmark.IsValid() && listed.Insert(landmark)) local.landmarks.push_back(landmark);
  return local;
}

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
