#include "oaslam/relocalization/by_points.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "oaslam/estimation/absolute_pose.h"
#include "oaslam/estimation/focal_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/matching/orientation_check.h"
#include "oaslam/relocalization/guided_search.h"

namespace oaslam {
namespace {

// Each takes a match and a RANSAC; the right one is mostly among the first.
constexpr int kMaxPlaces = 6;
constexpr int kMinMatches = 10;  // a RANSAC on fewer finds a pose by chance
// Largest ratio of the nearest to the second-nearest descriptor distance in a place; loose, since
// RANSAC rejects wrong matches.
constexpr double kRatio = 0.85;
// Around a place: they see most landmarks that the image may show.
constexpr int kLocalKeyframes = 15;

struct Match {
  int keypoint = 0;
  LandmarkId landmark;
  int distance = 0;
};

// The orientation of the landmark's key point in the first keyframe of the place that sees it.
float AngleIn(const Map& map, const Place& place, const Landmark& landmark) {
  for (const KeyframeId id : place.keyframes)
    for (const Observation& o : landmark.observations)
      if (o.keyframe == id) return map.keyframes.At(id).features->keypoints[o.keypoint].angle_rad;
  return 0;
}

// Keeps the closest match of each landmark, drops matches of inconsistent orientation, and sorts by
// descriptor distance.
std::vector<Match> Filter(const Map& map, const Features& features, const Place& place,
                          std::vector<Match> matches) {
  std::ranges::sort(matches, {},
                    [](const Match& m) { return std::tuple(m.landmark, m.distance, m.keypoint); });
  const auto repeats = std::ranges::unique(matches, {}, &Match::landmark);
  matches.erase(repeats.begin(), repeats.end());
  std::vector<float> turns;
  for (const Match& m : matches)
    turns.push_back(AngleIn(map, place, map.landmarks.At(m.landmark)) -
                    features.keypoints[m.keypoint].angle_rad);
  const std::vector<char> consistent = ConsistentOrientations(turns);
  std::vector<Match> kept;
  for (size_t i = 0; i < matches.size(); ++i)
    if (consistent[i]) kept.push_back(matches[i]);
  std::ranges::stable_sort(kept, {}, &Match::distance);
  return kept;
}

std::vector<Match> MatchPlace(const Map& map, const Features& features, const Place& place,
                              const LandmarkHits& hits) {
  const std::vector<LandmarkId> here = LandmarksSeenBy(map, place.keyframes);
  std::vector<Match> matches;
  for (int k = 0; k < static_cast<int>(hits.size()); ++k) {
    const DescriptorIndex::Hit *best = nullptr, *second = nullptr;
    for (const DescriptorIndex::Hit& hit : hits[k]) {
      if (!std::ranges::binary_search(here, LandmarkId(hit.label))) continue;
      (best ? second : best) = &hit;
      if (second) break;
    }
    if (best && (!second || best->distance < kRatio * second->distance))
      matches.push_back({k, LandmarkId(best->label), best->distance});
  }
  return Filter(map, features, place, std::move(matches));
}

AbsolutePoseReport PoseFromMatches(const Frame& frame, const Map& map,
                                   const std::vector<Match>& matches, int iterations, Rng& rng) {
  std::vector<PointObservation> observations;
  for (const Match& m : matches)
    observations.push_back(
        ObservationOf(*frame.features, m.keypoint, map.landmarks.At(m.landmark)));
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
                                            const std::vector<Match>& matches, int iterations,
                                            Rng& rng) {
  // Focal lengths from wide to long (96 to 20 degrees over the longer side), so dense that the one
  // nearest to the true one finds most of its inliers.
  constexpr double kShortest = 0.45, kLongest = 2.8, kStep = 1.2;  // of the longer side
  const Camera& camera = map.cameras[static_cast<size_t>(frame.camera)];
  const double longer = std::max(camera.width, camera.height);
  std::vector<PointObservation> observations;
  for (const Match& m : matches)
    observations.push_back(
        ObservationOf(*frame.features, m.keypoint, map.landmarks.At(m.landmark)));
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

void Keep(const RelocalizationReport& found, RelocalizationReport& best) {
  std::vector<PoseHypothesis> hypotheses = std::move(best.hypotheses);
  hypotheses.push_back({found.cam_from_world, static_cast<double>(found.inliers)});
  if (found.inliers > best.inliers || found.success) best = found;
  best.hypotheses = std::move(hypotheses);
}

}  // namespace

RelocalizationReport RelocalizeByPoints(const Frame& frame, const Map& map, const PlaceIndex& index,
                                        const RelocalizationConfig& config,
                                        const TrackingConfig& tracking, Rng& rng) {
  const Features& features = *frame.features;
  const LandmarkHits hits = index.Find(features);
  RelocalizationReport best;
  best.why_not = "no place of the map looks like this";
  for (const Place& place : index.RankPlaces(map, hits, kMaxPlaces)) {
    const std::vector<Match> matches = MatchPlace(map, features, place, hits);
    if (static_cast<int>(matches.size()) < kMinMatches) continue;
    const AbsolutePoseReport rough =
        PoseFromMatches(frame, map, matches, 3 * config.ransac_iterations, rng);
    if (!rough.success) continue;
    std::vector<KeyframeId> around =
        map.CovisibleKeyframes(place.keyframes.front(), kLocalKeyframes);
    around.push_back(place.keyframes.front());
    RelocalizationReport found =
        SearchAround(frame, map, LandmarksSeenBy(map, around), rough.cam_from_world);
    found.keyframe = place.keyframes.front();
    Judge(map, tracking.min_relocalization_inliers, tracking.min_relocalization_inliers, found);
    Keep(found, best);
    if (best.success) break;
  }
  std::ranges::stable_sort(best.hypotheses, std::ranges::greater{}, &PoseHypothesis::score);
  return best;
}

FocalRelocalization RefineFocal(const Frame& frame, const Map& map,
                                const RelocalizationReport& found, const TrackingConfig& tracking) {
  FocalRelocalization result{found, map.cameras[static_cast<size_t>(frame.camera)],
                             std::numeric_limits<double>::infinity()};
  std::vector<PointObservation> observations;
  for (int k = 0; k < static_cast<int>(found.landmarks.size()); ++k)
    if (found.landmarks[k].IsValid())
      observations.push_back(
          ObservationOf(*frame.features, k, map.landmarks.At(found.landmarks[k])));
  const FocalReport refined = RefinePoseAndFocal(result.camera, found.cam_from_world, observations);
  if (!refined.success) return result;
  result.camera = refined.camera;
  result.relative_sigma = refined.relative_sigma;
  result.report.cam_from_world = refined.cam_from_world;
  result.report.covariance = refined.covariance;
  result.report.sigma_position = SigmaOfPosition(refined.covariance);
  // An uncertain focal length makes the distance to the scene uncertain, too: Judge allows twice as
  // much as for a known camera.
  constexpr double kMaxRelativeSigma = 0.06;
  Judge(map, tracking.min_relocalization_inliers, tracking.min_relocalization_inliers,
        result.report, kMaxRelativeSigma);
  return result;
}

FocalRelocalization RelocalizeByPointsAndFocal(const Frame& frame, const Map& map,
                                               const PlaceIndex& index,
                                               const RelocalizationConfig& config,
                                               const TrackingConfig& tracking, Rng& rng) {
  const Features& features = *frame.features;
  const LandmarkHits hits = index.Find(features);
  FocalRelocalization best;
  best.camera = map.cameras[static_cast<size_t>(frame.camera)];
  best.report.why_not = "no place of the map looks like this, whatever the focal length";
  for (const Place& place : index.RankPlaces(map, hits, kMaxPlaces)) {
    const std::vector<Match> matches = MatchPlace(map, features, place, hits);
    if (static_cast<int>(matches.size()) < kMinMatches) continue;
    const std::optional<FocalReport> rough =
        FocalFromMatches(frame, map, matches, config.ransac_iterations, rng);
    if (!rough) continue;
    std::vector<KeyframeId> around =
        map.CovisibleKeyframes(place.keyframes.front(), kLocalKeyframes);
    around.push_back(place.keyframes.front());
    const std::vector<LandmarkId> landmarks = LandmarksSeenBy(map, around);
    FocalRelocalization found;
    found.camera = rough->camera;
    found.report.cam_from_world = rough->cam_from_world;
    // The points found with the rough focal length improve it, and with the improved one more
    // points are found.
    for (int round = 0; round < 2; ++round) {
      const Map with = WithCameraOf(map, frame, found.camera);
      found.report = SearchAround(frame, with, landmarks, found.report.cam_from_world);
      found = RefineFocal(frame, with, found.report, tracking);
    }
    found.report.keyframe = place.keyframes.front();
    const bool is_better = found.report.success || found.report.inliers > best.report.inliers;
    Keep(found.report, best.report);
    if (is_better) {
      best.camera = found.camera;
      best.relative_sigma = found.relative_sigma;
    }
    if (best.report.success) break;
  }
  std::ranges::stable_sort(best.report.hypotheses, std::ranges::greater{}, &PoseHypothesis::score);
  return best;
}

RelocalizationReport VerifyByPoints(const Frame& frame, const Map& map,
                                    const Rigid3& cam_from_world_guess, double search_radius_px,
                                    const RelocalizationConfig& config,
                                    const TrackingConfig& tracking, Rng& rng) {
  const Features& features = *frame.features;
  const std::vector<LandmarkId> all = map.landmarks.Ids();
  const auto projected = ProjectLandmarks(map, all, frame, cam_from_world_guess);
  const auto wide = SearchByProjection(features, map, projected,
                                       std::vector<LandmarkId>(features.keypoints.size()),
                                       {search_radius_px, 64, kRatio, false});
  RelocalizationReport report;
  std::vector<Match> matches;
  for (int k = 0; k < features.size(); ++k)
    if (wide.landmarks[k].IsValid())
      matches.push_back({k, wide.landmarks[k],
                         HammingDistance(map.landmarks.At(wide.landmarks[k]).descriptor,
                                         features.descriptors[k])});
  std::ranges::stable_sort(matches, {}, &Match::distance);
  const AbsolutePoseReport rough =
      PoseFromMatches(frame, map, matches, 3 * config.ransac_iterations, rng);
  report =
      SearchAround(frame, map, all, rough.success ? rough.cam_from_world : cam_from_world_guess);
  Judge(map, tracking.min_relocalization_inliers, config.min_matches, report);
  report.hypotheses.push_back({report.cam_from_world, static_cast<double>(report.inliers)});
  return report;
}

}  // namespace oaslam
