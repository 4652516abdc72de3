#include "oaslam/relocalization/by_points.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>

#include "oaslam/estimation/absolute_pose.h"
#include "oaslam/estimation/focal_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/matching/place_matching.h"
#include "oaslam/matching/place_search.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/relocalization/confidence.h"

namespace oaslam {
namespace {

// Each takes a match and a RANSAC; the right one is mostly among the first.
constexpr int kMaxPlaces = 6;
// Between the viewing directions of two images that may be matched: 70 degrees, since descriptors
// hardly match beyond 45, and one pose is not exact.
constexpr double kMinCosine = 0.342;

double CosineOfDirections(const Rigid3& cam_from_world, const Rigid3& other_cam_from_world) {
  return (cam_from_world.rotation.inverse() * Eigen::Vector3d::UnitZ())
      .dot(other_cam_from_world.rotation.inverse() * Eigen::Vector3d::UnitZ());
}

Camera WithFocal(const Camera& camera, double focal) {
  Camera changed = camera;
  changed.fy *= focal / camera.fx;
  changed.fx = focal;
  return changed;
}

// Estimates pose and focal length: of the focal lengths tried, takes the one for which most matches
// agree on a pose. Returns nothing where none has such a pose.
std::optional<FocalReport> FocalFromMatches(const Frame& frame,
                                            const std::vector<PlaceMatch>& matches, int iterations,
                                            Rng& rng) {
  // Focal lengths from wide to long (96 to 20 degrees over the longer side), so dense that the one
  // nearest to the true one finds most of its inliers.
  constexpr double kShortest = 0.45, kLongest = 2.8, kStep = 1.2;  // of the longer side
  const Camera& camera = *frame.camera;
  const double longer = std::max(camera.width, camera.height);
  std::vector<PointObservation> observations;
  for (const PlaceMatch& m : matches)
    observations.push_back(ObservationOf(*frame.features, m.keypoint, m.position));
  std::optional<FocalReport> best;
  for (double focal = kShortest * longer; focal < kLongest * longer; focal *= kStep) {
    const Camera guess = WithFocal(camera, focal);
    const AbsolutePoseReport rough = EstimateAbsolutePose(
        guess, observations, {.max_iterations = iterations, .min_inliers = 8}, rng);
    if (!rough.success) continue;
    FocalReport refined = RefinePoseAndFocal(guess, rough.cam_from_world, observations);
    const bool is_plausible = refined.camera.fx > kShortest / kStep * longer &&
                              refined.camera.fx < kLongest * kStep * longer;
    if (refined.success && is_plausible && (!best || refined.inliers > best->inliers))
      best = std::move(refined);
  }
  return best;
}

// Takes the better of two, and the hypotheses of both.
void Keep(Relocalization found, Relocalization& best) {
  std::vector<PoseHypothesis> candidates = std::move(best.candidates);
  candidates.push_back({found.cam_from_world, static_cast<double>(found.points.inliers)});
  if (candidates.size() == 1 || found.confidence > best.confidence) best = std::move(found);
  best.candidates = std::move(candidates);
  best.candidates_are_by = PoseEvidence::kPoints;
}

}  // namespace

Relocalization RelocalizeByPoints(const Frame& frame, const Map& map, const PlaceIndex& index,
                                  const RelocalizationConfig& config, Rng& rng,
                                  Appearance appearance, const std::optional<Rigid3>& roughly) {
  const PlaceSearchOptions options{3 * kRansacIterations, config.accept_confidence};
  const LandmarkHits hits = index.Find(*frame.features, appearance);
  Relocalization best;
  best.why_not = "no place of the map looks like this";
  for (const Place& place : index.RankPlaces(map, hits, kMaxPlaces)) {
    const Keyframe& keyframe = map.keyframes.At(place.keyframes.front());
    if (roughly && CosineOfDirections(keyframe.cam_from_world, *roughly) < kMinCosine) continue;
    std::optional<Relocalization> found = FindAtPlace(frame, map, place, appearance, options, rng);
    if (!found) continue;
    Keep(*std::move(found), best);
    if (best.confidence > kConfidenceThatEndsSearch) break;
  }
  std::ranges::stable_sort(best.candidates, std::ranges::greater{}, &PoseHypothesis::score);
  return best;
}

Relocalization RefineFocal(const Frame& frame, const Map& map, Relocalization found,
                           double min_confidence) {
  found.camera = *frame.camera;
  found.focal_sigma = std::numeric_limits<double>::infinity();
  const std::vector<LandmarkId>& landmarks = found.points.landmarks;
  std::vector<PointObservation> observations;
  for (int k = 0; k < static_cast<int>(landmarks.size()); ++k)
    if (landmarks[k].IsValid())
      observations.push_back(ObservationOf(*frame.features, k, map.landmarks.At(landmarks[k])));
  const FocalReport refined = RefinePoseAndFocal(*found.camera, found.cam_from_world, observations);
  if (!refined.success) return found;
  found.camera = refined.camera;
  found.focal_sigma = refined.relative_sigma;
  found.cam_from_world = refined.cam_from_world;
  found.covariance = refined.covariance;
  // An uncertain focal length makes the distance to the scene uncertain, in a right pose, too.
  constexpr double kTolerance = 2;
  Weigh(map, found, kTolerance);
  Judge(min_confidence, found);
  return found;
}

Relocalization RelocalizeByPointsAndFocal(const Frame& frame, const Map& map,
                                          const PlaceIndex& index,
                                          const RelocalizationConfig& config, Rng& rng,
                                          Appearance appearance) {
  const Features& features = *frame.features;
  const LandmarkHits hits = index.Find(features, appearance);
  Relocalization best;
  best.why_not = "no place of the map looks like this, whatever the focal length";
  for (const Place& place : index.RankPlaces(map, hits, kMaxPlaces)) {
    const std::vector<PlaceMatch> matches = MatchPlace(features, map, place, appearance);
    if (static_cast<int>(matches.size()) < kMinMatches) continue;
    const std::optional<FocalReport> rough =
        FocalFromMatches(frame, matches, kRansacIterations, rng);
    if (!rough) continue;
    const std::vector<LandmarkId> landmarks = LandmarksAround(map, place.keyframes.front());
    Frame seen = frame;
    seen.camera = std::make_shared<const Camera>(rough->camera);
    Relocalization found;
    found.cam_from_world = rough->cam_from_world;
    // The points found with the rough focal length improve it, and with the improved one more
    // points are found.
    for (int round = 0; round < 2; ++round) {
      found = RefineFocal(seen, map,
                          SearchAround(seen, map, landmarks, found.cam_from_world, appearance),
                          config.accept_confidence);
      seen.camera = std::make_shared<const Camera>(*found.camera);
    }
    Keep(std::move(found), best);
    if (best.IsFound()) break;
  }
  std::ranges::stable_sort(best.candidates, std::ranges::greater{}, &PoseHypothesis::score);
  return best;
}

}  // namespace oaslam
