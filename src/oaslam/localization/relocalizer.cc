#include "oaslam/localization/relocalizer.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "oaslam/description/describe_features.h"
#include "oaslam/relocalization/by_objects_paper.h"
#include "oaslam/relocalization/by_points.h"
#include "oaslam/relocalization/confidence.h"

namespace oaslam {
namespace {

// The standard deviation of the position divided by the mean distance to the matched objects.
double RelativeSigma(const Map& map, const ObjectPoseCandidate& candidate) {
  double distance = 0;
  for (const auto& [detection, object] : candidate.matched)
    distance += (candidate.cam_from_world * map.objects.At(object).ellipsoid.center).norm();
  return distance > 0
             ? candidate.sigma_position * static_cast<double>(candidate.matched.size()) / distance
             : 1;
}

// Points that are this likely to be right by themselves confirm a pose that is already supported by
// something else.
constexpr double kConfirms = 0.9;

// 1.6 and 6.5 degrees; wider finds wrong matches.
constexpr double kMinErrorRad = 1.0 / 35, kMaxErrorRad = 4.0 / 35;

// The search radius for landmarks around a pose, given its error as an angle in the image.
double SearchRadius(const Map& map, const Frame& frame, double error_rad) {
  const Camera& camera = map.cameras[static_cast<size_t>(frame.camera)];
  return error_rad * std::sqrt(camera.fx * camera.fy) / frame.features->pyramid.working_pixel();
}

// The search radius for landmarks around a pose from objects: the pixels by which its error moves
// points at the objects' depth.
double SearchRadius(const Map& map, const Frame& frame, const ObjectPoseCandidate& candidate) {
  constexpr double kSigmas = 3;  // 99.7 % of normal errors
  return SearchRadius(
      map, frame, std::clamp(kSigmas * RelativeSigma(map, candidate), kMinErrorRad, kMaxErrorRad));
}

// Whether two poses agree. A few points in one corner of the image can agree on a pose that is far
// off, which boxes spread over the image reveal.
bool Agree(const RelocalizationReport& by_points, const ObjectPoseCandidate& by_objects) {
  constexpr double kMaxSigmas = 4;  // wide, since the sigmas neglect that errors are correlated
  const double distance =
      (by_points.cam_from_world.OriginInSource() - by_objects.cam_from_world.OriginInSource())
          .norm();
  return distance < kMaxSigmas * std::hypot(by_points.sigma_position, by_objects.sigma_position);
}

Relocalization FromPoints(const RelocalizationReport& report, PoseEvidence evidence) {
  Relocalization result;
  result.evidence = report.success ? evidence : PoseEvidence::kNone;
  result.cam_from_world = report.cam_from_world;
  result.landmarks = report.landmarks;
  result.inliers = report.inliers;
  result.sigma_position = report.sigma_position;
  result.confidence = report.confidence;
  result.candidates = report.hypotheses;
  if (!result.candidates.empty()) result.candidates_are_by = PoseEvidence::kPoints;
  result.why_not = report.why_not;
  return result;
}

bool IsSamePose(const Rigid3& a, const Rigid3& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}

// The reason for a frame that was found neither by points nor by objects.
std::string WhyNeither(const std::string& points, const std::string& objects) {
  return "by points: " + points + "; by objects: " + objects;
}

}  // namespace

// Puts the accepted pose, which is one of the candidates or a refinement of one, in front of them.
void Relocalizer::LeadWithAccepted(Relocalization& found) {
  if (found.evidence == PoseEvidence::kNone) return;
  if (found.candidates_are_by == PoseEvidence::kNone)
    found.candidates_are_by = PoseEvidence::kPoints;
  const bool is_by_points = found.candidates_are_by == PoseEvidence::kPoints;
  const double score = is_by_points ? found.inliers : found.object_score;
  std::erase_if(found.candidates, [&](const PoseHypothesis& candidate) {
    return IsSamePose(candidate.cam_from_world, found.cam_from_world);
  });
  found.candidates.insert(found.candidates.begin(), {found.cam_from_world, score});
}

bool LandmarkIndex::IsOf(const Map& map) const {
  bool are_same = true;  // compares pages, not landmarks
  landmarks.ForEachDifference(
      map.landmarks, [&](LandmarkId, const Landmark*, const Landmark*) { are_same = false; });
  return are_same;
}

const PlaceIndex& Relocalizer::IndexOf(const Map& map) {
  if (!index_ || !index_->IsOf(map)) index_ = std::make_shared<const LandmarkIndex>(map);
  return index_->places;
}

std::optional<Relocalization> Relocalizer::Near(const Rigid3& world_from_cam, const Frame& frame,
                                                const Map& map, Rng& rng) const {
  const RelocalizationReport report =
      VerifyByPoints(frame, map, world_from_cam.Inverse(), SearchRadius(map, frame, kMaxErrorRad),
                     config_.relocalization, kConfirms, rng);
  if (!report.success) return std::nullopt;
  Relocalization found = FromPoints(report, PoseEvidence::kPoints);
  found.candidates = {{report.cam_from_world, static_cast<double>(report.inliers)}};
  found.candidates_are_by = PoseEvidence::kPoints;
  return found;
}

Relocalization Relocalizer::ByPoints(const Frame& frame, const Map& map, bool join_objects,
                                     Appearance appearance, Rng& rng) {
  const RelocalizationReport report =
      RelocalizeByPoints(frame, map, IndexOf(map), config_.relocalization, rng, appearance);
  const bool are_few = report.inliers < 2 * config_.tracking.min_relocalization_inliers;
  if (report.success && join_objects && are_few)
    return JoinObjects(frame, map, report, PoseEvidence::kPoints);
  return FromPoints(report, PoseEvidence::kPoints);
}

Relocalization Relocalizer::JoinObjects(const Frame& frame, const Map& map,
                                        const RelocalizationReport& by_points,
                                        PoseEvidence evidence) const {
  Relocalization result = FromPoints(by_points, evidence);
  if (IsAsInPaper()) return result;
  const ObjectPoseCandidate joint = RefineByPointsAndObjects(
      frame.detections, map.cameras[frame.camera], map, config_.relocalization, by_points);
  result.matched_objects = static_cast<int>(joint.matched.size());
  if (result.matched_objects < config_.relocalization.accept_objects) return result;
  result.cam_from_world = joint.cam_from_world;
  result.sigma_position = joint.sigma_position;
  return result;
}

std::vector<ObjectPoseCandidate> Relocalizer::CandidatesByObjects(
    const Frame& frame, const Map& map, const std::optional<Eigen::Vector3d>& gravity_in_cam,
    Rng& rng, ObjectTrails* trails) const {
  const Camera& camera = map.cameras[frame.camera];
  if (IsAsInPaper())
    return RelocalizeByObjectsAsInPaper(frame.detections, camera, map, config_.relocalization, rng);
  if (trails)
    return trails->Follow(frame.timestamp, frame.detections, camera, map, config_.relocalization,
                          gravity_in_cam, rng);
  return RelocalizeByObjects(frame.detections, camera, map, config_.relocalization, gravity_in_cam,
                             rng);
}

double Relocalizer::ConfidenceIn(const ObjectPoseCandidate& candidate) const {
  return IsAsInPaper() ? 0 : ConfidenceOf(candidate);
}

Relocalization Relocalizer::ByObjects(const Frame& frame, const Map& map, bool confirm_by_points,
                                      const std::vector<ObjectPoseCandidate>& candidates,
                                      Rng& rng) const {
  Relocalization result;
  for (const ObjectPoseCandidate& c : candidates)
    result.candidates.push_back({c.cam_from_world, c.score});
  if (!candidates.empty()) result.candidates_are_by = PoseEvidence::kObjects;
  if (confirm_by_points && frame.features)
    for (const ObjectPoseCandidate& c : candidates) {
      if (c.margin < -config_.relocalization.accept_margin) continue;  // they speak against it
      const RelocalizationReport report =
          VerifyByPoints(frame, map, c.cam_from_world, SearchRadius(map, frame, c),
                         config_.relocalization, kConfirms, rng);
      if (!report.success || !Agree(report, c)) continue;
      Relocalization confirmed = JoinObjects(frame, map, report, PoseEvidence::kPointsAndObjects);
      confirmed.confidence = ConfidenceOfBoth(confirmed.confidence, ConfidenceIn(c));
      confirmed.objects_suffice = c.accepted;
      confirmed.relative_sigma = RelativeSigma(map, c);
      confirmed.object_score = c.score;
      confirmed.object_margin = c.margin;
      confirmed.candidates = std::move(result.candidates);
      confirmed.candidates_are_by = result.candidates_are_by;
      return confirmed;
    }
  if (candidates.empty()) {
    result.why_not = "no pose explains three detections";
    return result;
  }
  const ObjectPoseCandidate& best = candidates.front();
  result.object_score = best.score;
  result.object_margin = best.margin;
  result.confidence = ConfidenceIn(best);
  result.matched_objects = static_cast<int>(best.matched.size());
  const bool is_sure =
      IsAsInPaper() || result.confidence >= config_.relocalization.accept_confidence;
  if (!best.accepted || !is_sure) {
    result.why_not = "the objects' evidence is too weak";
    return result;
  }
  result.evidence = PoseEvidence::kObjects;
  result.cam_from_world = best.cam_from_world;
  result.sigma_position = best.sigma_position;
  result.relative_sigma = RelativeSigma(map, best);
  return result;
}

Relocalization Relocalizer::FindBy(Appearance appearance, const Frame& frame, const Map& map,
                                   RelocalizationMode mode, Rng& rng,
                                   const CandidateSource& candidates) {
  const bool use_points = mode != RelocalizationMode::kObjects && frame.features;
  Relocalization result;
  if (use_points)
    result = ByPoints(frame, map, mode == RelocalizationMode::kPointsAndObjects, appearance, rng);
  if (result.evidence != PoseEvidence::kNone || mode == RelocalizationMode::kPoints) return result;
  Relocalization by_objects = ByObjects(frame, map, use_points, candidates(), rng);
  const bool are_both_vain = use_points && by_objects.evidence == PoseEvidence::kNone;
  const std::string why_neither =
      frame.detections.empty() ? result.why_not : WhyNeither(result.why_not, by_objects.why_not);
  if (!use_points || !by_objects.candidates.empty()) result = std::move(by_objects);
  if (are_both_vain) result.why_not = why_neither;
  return result;
}

Relocalization Relocalizer::Find(const Frame& frame, const Map& map, RelocalizationMode mode,
                                 const std::optional<Eigen::Vector3d>& gravity_in_cam, Rng& rng,
                                 ObjectTrails* trails, const std::optional<Rigid3>& prior) {
  const bool use_points = mode != RelocalizationMode::kObjects && frame.features;
  if (prior && use_points)
    if (std::optional<Relocalization> near = Near(*prior, frame, map, rng)) return *std::move(near);
  std::optional<std::vector<ObjectPoseCandidate>> known;
  const CandidateSource candidates = [&]() -> const std::vector<ObjectPoseCandidate>& {
    if (!known) known = CandidatesByObjects(frame, map, gravity_in_cam, rng, trails);
    return *known;
  };
  Relocalization result = FindBy(Appearance::kOrb, frame, map, mode, rng, candidates);
  const bool has_learned = use_points && (frame.image || !frame.features->learned.empty()) &&
                           IndexOf(map).Has(Appearance::kLearned);
  if (has_learned && result.evidence == PoseEvidence::kNone) {
    Frame described = frame;
    if (frame.image)
      described.features = std::make_shared<const Features>(Described(
          *frame.features, map.cameras[static_cast<size_t>(frame.camera)], frame.image->view()));
    Relocalization by_learned = FindBy(Appearance::kLearned, described, map, mode, rng, candidates);
    if (by_learned.evidence != PoseEvidence::kNone || by_learned.confidence > result.confidence)
      result = std::move(by_learned);
  }
  LeadWithAccepted(result);
  return result;
}

}  // namespace oaslam
