#include "oaslam/relocalization/frame_search.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "oaslam/matching/place_search.h"
#include "oaslam/objects/box_depth.h"
#include "oaslam/relocalization/by_depths.h"
#include "oaslam/relocalization/by_objects.h"
#include "oaslam/relocalization/by_objects_paper.h"
#include "oaslam/relocalization/by_points.h"
#include "oaslam/relocalization/confidence.h"

namespace oaslam {
namespace {

// Points that are this likely to be right by themselves confirm a pose that is already supported by
// something else.
constexpr double kConfirms = 0.9;

// At most, of a pose by objects where points should confirm it and do not: rooms that are arranged
// alike have the same objects at the same places.
constexpr double kUnconfirmed = 0.5;

// 1.6 and 6.5 degrees; wider finds wrong matches.
constexpr double kMinErrorRad = 1.0 / 35, kMaxErrorRad = 4.0 / 35;

// The search radius for landmarks around a pose, given its error as an angle in the image.
double SearchRadius(const Frame& frame, double error_rad) {
  const Camera& camera = *frame.camera;
  return error_rad * std::sqrt(camera.fx * camera.fy) / frame.features->pyramid.working_pixel();
}

// The error of a pose by objects as an angle: how far it moves points at the objects' depth.
double ErrorAngle(const ObjectSupport& objects) {
  constexpr double kSigmas = 3;  // 99.7 % of normal errors
  return std::clamp(kSigmas * objects.relative_sigma, kMinErrorRad, kMaxErrorRad);
}

// Whether two poses agree. A few points in one corner of the image can agree on a pose that is far
// off, which boxes spread over the image reveal.
bool Agree(const Relocalization& by_points, const Relocalization& by_objects) {
  constexpr double kMaxSigmas = 4;  // wide, since the sigmas neglect that errors are correlated
  const double distance =
      (by_points.cam_from_world.OriginInSource() - by_objects.cam_from_world.OriginInSource())
          .norm();
  return distance <
         kMaxSigmas * std::hypot(by_points.sigma_position(), by_objects.sigma_position());
}

bool IsSamePose(const Rigid3& a, const Rigid3& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}

}  // namespace

void LeadWithAccepted(Relocalization& found) {
  if (!found.IsFound()) return;
  const bool is_by_points = found.candidates_are_by == PoseEvidence::kPoints;
  const double score = is_by_points ? found.points.inliers : found.objects.score;
  std::erase_if(found.candidates, [&](const PoseHypothesis& candidate) {
    return IsSamePose(candidate.cam_from_world, found.cam_from_world);
  });
  found.candidates.insert(found.candidates.begin(), {found.cam_from_world, score});
}

std::optional<Relocalization> FrameSearch::Near(const Frame& frame,
                                                const Rigid3& cam_from_world) const {
  Relocalization found = Confirmed(frame, cam_from_world, kMaxErrorRad);
  if (found.IsFound()) ApplyDepths(frame, map_, found);
  const bool is_sure = found.confidence >= tools_.config.relocalization.accept_confidence;
  return found.IsFound() && is_sure ? std::optional(std::move(found)) : std::nullopt;
}

Relocalization FrameSearch::Confirmed(const Frame& frame, const Rigid3& cam_from_world,
                                      double error_rad) const {
  return FindNear(frame, map_, map_.landmarks.Ids(), cam_from_world, SearchRadius(frame, error_rad),
                  {3 * kRansacIterations, kConfirms}, tools_.rng);
}

Relocalization FrameSearch::ByPoints(const Frame& frame, Appearance appearance,
                                     const std::optional<Rigid3>& roughly) const {
  Relocalization found = RelocalizeByPoints(
      frame, map_, *tools_.places, tools_.config.relocalization, tools_.rng, appearance, roughly);
  if (found.IsFound() && tools_.mode == RelocalizationMode::kPointsAndObjects)
    JoinObjects(frame, found);
  if (found.IsFound()) ApplyDepths(frame, map_, found);
  return found;
}

std::optional<size_t> FrameSearch::JoinObjects(const Frame& frame, Relocalization& found) const {
  const RelocalizationConfig& config = tools_.config.relocalization;
  const bool are_few = found.points.inliers < 2 * kMinRelocalizationInliers;
  if (IsAsInPaper() || !are_few) return std::nullopt;
  Relocalization joint =
      RefineByPointsAndObjects(WithSurfaces(frame, map_), *frame.camera, map_, config, found);
  found.objects.matched = std::move(joint.objects.matched);
  if (static_cast<int>(found.objects.matched.size()) >= config.accept_objects) {
    found.cam_from_world = joint.cam_from_world;
    found.covariance = joint.covariance;
  }
  return found.objects.matched.size();
}

const std::vector<Relocalization>& FrameSearch::PosesByObjects(const Frame& frame) {
  if (!poses_by_objects_) poses_by_objects_ = SearchPosesByObjects(frame);
  return *poses_by_objects_;
}

std::vector<Relocalization> FrameSearch::SearchPosesByObjects(const Frame& frame) const {
  const Camera& camera = *frame.camera;
  const RelocalizationConfig& config = tools_.config.relocalization;
  if (IsAsInPaper())
    return RelocalizeByObjectsAsInPaper(frame.detections, camera, map_, config, tools_.rng);
  const std::vector<ObjectDetection> detections = WithSurfaces(frame, map_);
  std::vector<Relocalization> poses =
      tools_.trails
          ? tools_.trails->Follow(frame.timestamp, detections, camera, map_, config,
                                  frame.gravity_in_cam, tools_.rng)
          : RelocalizeByObjects(detections, camera, map_, config, frame.gravity_in_cam, tools_.rng);
  for (Relocalization& pose : poses) ApplyDepths(frame, map_, pose);
  return poses;
}

// The best pose by objects, or the first that points confirm.
Relocalization FrameSearch::ByObjects(const Frame& frame) {
  const std::vector<Relocalization>& poses = PosesByObjects(frame);
  if (poses.empty()) {
    Relocalization none;
    none.why_not = "no pose explains three detections";
    return none;
  }
  std::vector<PoseHypothesis> candidates;
  for (const Relocalization& pose : poses)
    candidates.push_back({pose.cam_from_world, pose.objects.score});
  const auto with_candidates = [&](Relocalization found) {
    found.candidates = std::move(candidates);
    found.candidates_are_by = PoseEvidence::kObjects;
    return found;
  };
  const RelocalizationConfig& config = tools_.config.relocalization;
  for (const Relocalization& pose : poses) {
    if (!tools_.places) break;
    if (pose.objects.margin < -config.accept_margin) continue;  // they speak against it
    Relocalization confirmed = Confirmed(frame, pose.cam_from_world, ErrorAngle(pose.objects));
    if (!confirmed.IsFound() || !Agree(confirmed, pose)) continue;
    // Few points agree by chance with a pose in which most of these objects are elsewhere.
    const std::optional<size_t> agree = JoinObjects(frame, confirmed);
    if (agree && 2 * *agree < pose.objects.matched.size()) continue;
    ApplyDepths(frame, map_, confirmed);
    if (!confirmed.IsFound()) continue;
    confirmed.evidence = PoseEvidence::kPointsAndObjects;
    confirmed.confidence = ConfidenceOfBoth(confirmed.confidence, pose.confidence);
    if (!IsAsInPaper() && confirmed.confidence < config.accept_confidence) continue;
    ObjectSupport objects = pose.objects;
    if (!confirmed.objects.matched.empty()) objects.matched = std::move(confirmed.objects.matched);
    confirmed.objects = std::move(objects);
    return with_candidates(std::move(confirmed));
  }
  Relocalization best = poses.front();
  if (best.IsFound() && tools_.places) {
    const double alone = IsAsInPaper() ? best.confidence : ConfidenceOfObjectsAlone(best.objects);
    best.confidence = alone;
    const bool is_mapped = IsMappedFrom(frame, best.cam_from_world);
    if (is_mapped) best.confidence = std::min(best.confidence, kUnconfirmed);
    if (is_mapped || (!IsAsInPaper() && alone < config.accept_confidence)) {
      best.evidence = PoseEvidence::kNone;
      best.why_not = is_mapped
                         ? "objects agree with a pose from where the map shows other points"
                         : "objects alone do not tell this room from one that is arranged alike, "
                           "or leave the position uncertain";
    }
  }
  return with_candidates(std::move(best));
}

bool FrameSearch::IsMappedFrom(const Frame& frame, const Rigid3& cam_from_world) const {
  constexpr int kFewKeypoints = 300;        // as in a blurred image: none may be found again
  constexpr double kSameDirection = 0.819;  // 35 degrees: descriptors find points again
  constexpr double kSamePlace = 0.8;        // of the depth
  constexpr int kLeastLandmarks = 100;
  if (frame.features->size() < kFewKeypoints) return false;
  const Eigen::Vector3d center = cam_from_world.OriginInSource(),
                        forward = cam_from_world.rotation.inverse() * Eigen::Vector3d::UnitZ();
  bool is_mapped = false;
  map_.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    const Rigid3& pose = keyframe.cam_from_world;
    if (is_mapped ||
        (pose.rotation.inverse() * Eigen::Vector3d::UnitZ()).dot(forward) < kSameDirection)
      return;
    is_mapped = (pose.OriginInSource() - center).norm() < kSamePlace * map_.MedianDepth(id) &&
                std::ranges::count_if(keyframe.landmarks,
                                      [](LandmarkId l) { return l.IsValid(); }) >= kLeastLandmarks;
  });
  return is_mapped;
}

std::optional<Relocalization> FrameSearch::BySureObjects(const Frame& frame) {
  if (!tools_.places || tools_.mode == RelocalizationMode::kPoints || IsAsInPaper())
    return std::nullopt;
  const std::vector<Relocalization>& poses = PosesByObjects(frame);
  if (poses.empty() || !poses.front().IsFound() ||
      poses.front().confidence < kConfidenceThatEndsSearch)
    return std::nullopt;
  return ByObjects(frame);
}

Relocalization FrameSearch::Find(const Frame& frame,
                                 const std::function<std::optional<Frame>()>& learned) {
  Relocalization found = By(Appearance::kOrb, frame);
  if (!found.IsFound())
    if (const std::optional<Frame> described = learned()) {
      Relocalization by_learned = By(Appearance::kLearned, *described);
      if (by_learned.IsFound() || by_learned.confidence > found.confidence)
        found = std::move(by_learned);
    }
  LeadWithAccepted(found);
  return found;
}

Relocalization FrameSearch::By(Appearance appearance, const Frame& frame) {
  std::optional<Relocalization> sure = BySureObjects(frame);
  if (sure && sure->evidence == PoseEvidence::kPointsAndObjects) return *std::move(sure);
  Relocalization by_points;
  if (tools_.places)
    by_points =
        ByPoints(frame, appearance, sure ? std::optional(sure->cam_from_world) : std::nullopt);
  if (by_points.IsFound() || tools_.mode == RelocalizationMode::kPoints) return by_points;
  Relocalization found = sure ? *std::move(sure) : ByObjects(frame);
  if (!tools_.places || found.IsFound()) return found;
  const std::string why_neither = frame.detections.empty() ? by_points.why_not
                                                           : "by points: " + by_points.why_not +
                                                                 "; by objects: " + found.why_not;
  if (found.candidates.empty()) found = std::move(by_points);
  found.why_not = why_neither;
  return found;
}

}  // namespace oaslam
