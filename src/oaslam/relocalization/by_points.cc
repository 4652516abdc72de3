#include "oaslam/relocalization/by_points.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include "oaslam/estimation/absolute_pose.h"
#include "oaslam/estimation/focal_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/relocalization/guided_search.h"
#include "oaslam/relocalization/place_matching.h"

namespace oaslam {
namespace {

// Each takes a match and a RANSAC; the right one is mostly among the first.
constexpr int kMaxPlaces = 6;
constexpr int kMinMatches = 10;  // a RANSAC on fewer finds a pose by chance
// In a wide search around a pose: stricter than in a place, since one view of each landmark counts.
constexpr int kMaxHammingAround = 64;
constexpr double kRatioAround = 0.85;
// Of a pose so likely, no other place is compared.
constexpr double kSure = 0.998;

AbsolutePoseReport PoseFromMatches(const Frame& frame, const Map& map,
                                   const std::vector<PlaceMatch>& matches, int iterations,
                                   Rng& rng) {
  std::vector<PointObservation> observations;
  for (const PlaceMatch& m : matches)
    observations.push_back(ObservationOf(*frame.features, m.keypoint, m.position));
  return EstimateAbsolutePose(map.cameras[frame.camera], observations,
                              {.max_iterations = iterations, .min_inliers = 8}, rng);
}

Camera WithFocal(const Camera& camera, double focal) {
  Camera changed = camera;
  changed.fy *= focal / camera.fx;
  changed.fx = focal;
  return changed;
}

Map WithCameraOf(const Map& map, const Frame& frame, const Camera& camera) {
  Map changed = map;  // shares its tables
  changed.cameras[static_cast<size_t>(frame.camera)] = camera;
  return changed;
}

// Estimates pose and focal length: of the focal lengths tried, takes the one for which most matches
// agree on a pose. Returns nothing where none has such a pose.
std::optional<FocalReport> FocalFromMatches(const Frame& frame, const Map& map,
                                            const std::vector<PlaceMatch>& matches, int iterations,
                                            Rng& rng) {
  // Focal lengths from wide to long (96 to 20 degrees over the longer side), so dense that the one
  // nearest to the true one finds most of its inliers.
  constexpr double kShortest = 0.45, kLongest = 2.8, kStep = 1.2;  // of the longer side
  const Camera& camera = map.cameras[static_cast<size_t>(frame.camera)];
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

std::vector<LandmarkId> LandmarksAround(const Map& map, KeyframeId place) {
  // They see most landmarks that the image may show.
  constexpr int kLocalKeyframes = 15;
  return LandmarksSeenBy(map, map.KeyframesAround(place, kLocalKeyframes));
}

// The keyframe that sees most of these landmarks.
KeyframeId PlaceOf(const Map& map, const std::vector<LandmarkId>& landmarks) {
  std::map<KeyframeId, int> seen;
  for (const LandmarkId id : landmarks)
    for (const Observation& o : map.landmarks.At(id).observations) ++seen[o.keyframe];
  return std::ranges::max_element(seen, {}, [](const auto& k) { return k.second; })->first;
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
                                  Appearance appearance) {
  const Features& features = *frame.features;
  const LandmarkHits hits = index.Find(features, appearance);
  Relocalization best;
  best.why_not = "no place of the map looks like this";
  for (const Place& place : index.RankPlaces(map, hits, kMaxPlaces)) {
    const std::vector<PlaceMatch> matches = MatchPlace(features, map, place, appearance);
    if (static_cast<int>(matches.size()) < kMinMatches) continue;
    const AbsolutePoseReport rough =
        PoseFromMatches(frame, map, matches, 3 * config.ransac_iterations, rng);
    if (!rough.success) continue;
    Relocalization found = SearchAround(frame, map, LandmarksAround(map, place.keyframes.front()),
                                        rough.cam_from_world);
    Judge(config.accept_confidence, found);
    Keep(std::move(found), best);
    if (best.confidence > kSure) break;
  }
  std::ranges::stable_sort(best.candidates, std::ranges::greater{}, &PoseHypothesis::score);
  return best;
}

Relocalization RefineFocal(const Frame& frame, const Map& map, Relocalization found,
                           double min_confidence) {
  found.camera = map.cameras[static_cast<size_t>(frame.camera)];
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
        FocalFromMatches(frame, map, matches, config.ransac_iterations, rng);
    if (!rough) continue;
    const std::vector<LandmarkId> landmarks = LandmarksAround(map, place.keyframes.front());
    Camera camera = rough->camera;
    Relocalization found;
    found.cam_from_world = rough->cam_from_world;
    // The points found with the rough focal length improve it, and with the improved one more
    // points are found.
    for (int round = 0; round < 2; ++round) {
      const Map with = WithCameraOf(map, frame, camera);
      found = RefineFocal(frame, with, SearchAround(frame, with, landmarks, found.cam_from_world),
                          config.accept_confidence);
      camera = *found.camera;
    }
    Keep(std::move(found), best);
    if (best.IsFound()) break;
  }
  std::ranges::stable_sort(best.candidates, std::ranges::greater{}, &PoseHypothesis::score);
  return best;
}

Relocalization VerifyByPoints(const Frame& frame, const Map& map,
                              const Rigid3& cam_from_world_guess, double search_radius_px,
                              const RelocalizationConfig& config, double min_confidence, Rng& rng) {
  const Features& features = *frame.features;
  const auto projected = ProjectLandmarks(map, map.landmarks.Ids(), frame, cam_from_world_guess);
  const auto wide = SearchByProjection(
      features, map, projected, std::vector<LandmarkId>(features.keypoints.size()),
      {search_radius_px, kMaxHammingAround, kRatioAround, false, !features.learned.empty()});
  std::vector<PlaceMatch> matches;
  for (int k = 0; k < features.size(); ++k)
    if (wide.landmarks[k].IsValid())
      matches.push_back(
          {k, wide.landmarks[k], map.landmarks.At(wide.landmarks[k]).position, wide.distances[k]});
  std::ranges::stable_sort(matches, {}, &PlaceMatch::distance);
  const AbsolutePoseReport rough =
      PoseFromMatches(frame, map, matches, 3 * config.ransac_iterations, rng);
  Relocalization found;
  found.why_not = "no landmarks are where this pose would have them";
  std::vector<LandmarkId> agree;
  for (size_t i = 0; i < matches.size(); ++i)
    if (!rough.success || rough.inlier[i]) agree.push_back(matches[i].landmark);
  if (agree.empty()) return found;
  found = SearchAround(frame, map, LandmarksAround(map, PlaceOf(map, agree)),
                       rough.success ? rough.cam_from_world : cam_from_world_guess);
  Judge(min_confidence, found);
  found.candidates = {{found.cam_from_world, static_cast<double>(found.points.inliers)}};
  found.candidates_are_by = PoseEvidence::kPoints;
  return found;
}

}  // namespace oaslam
