#include "oaslam/relocalization/by_points.h"

#include <algorithm>

#include "oaslam/estimation/absolute_pose.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/matching/orientation_check.h"
#include "oaslam/relocalization/guided_search.h"

namespace oaslam {
namespace {

constexpr int kMaxPlaces = 6;
constexpr int kMinMatches = 10;
constexpr double kRatio = 0.85;    // of the nearest to the second nearest descriptor in a place
constexpr int kLocalKeyframes = 15;

struct Match {
  int keypoint = 0;
  LandmarkId landmark;
  int distance = 0;
};

// The angle of a landmark's key point in the first keyframe of the place that sees it.
float AngleIn(const Map& map, const Place& place, const Landmark& landmark) {
  for (const KeyframeId id : place.keyframes)
    for (const Observation& o : landmark.observations)
      if (o.keyframe == id) return map.keyframes.At(id).features->keypoints[o.keypoint].angle_rad;
  return 0;
}

// The closest match of each landmark, those that turn together, most certain first.
std::vector<Match> Filter(const Map& map, const Features& features, const Place& place, std::vector<Match> matches) {
  std::ranges::sort(matches, {}, [](const Match& m) { return std::tuple(m.landmark, m.distance, m.keypoint); });
  const auto repeats = std::ranges::unique(matches, {}, &Match::landmark);
  matches.erase(repeats.begin(), repeats.end());
  std::vector<float> turns;
  for (const Match& m : matches)
    turns.push_back(AngleIn(map, place, map.landmarks.At(m.landmark)) - features.keypoints[m.keypoint].angle_rad);
  const std::vector<char> consistent = ConsistentOrientations(turns);
  std::vector<Match> kept;
  for (size_t i = 0; i < matches.size(); ++i)
    if (consistent[i]) kept.push_back(matches[i]);
  std::ranges::stable_sort(kept, {}, &Match::distance);
  return kept;
}

std::vector<Match> MatchPlace(const Map& map, const Features& features, const Place& place, const LandmarkHits& hits) {
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

AbsolutePoseReport PoseFromMatches(const Frame& frame, const Map& map, const std::vector<Match>& matches, int iterations, Rng& rng) {
  std::vector<PointObservation> observations;
  for (const Match& m : matches) observations.push_back(ObservationOf(*frame.features, m.keypoint, map.landmarks.At(m.landmark)));
  return EstimateAbsolutePose(map.cameras[frame.camera], observations, {.max_iterations = iterations, .min_inliers = 8}, rng);
}

void Keep(const RelocalizationReport& found, RelocalizationReport& best) {
  std::vector<PoseHypothesis> hypotheses = std::move(best.hypotheses);
  hypotheses.push_back({found.cam_from_world, static_cast<double>(found.inliers)});
  if (found.inliers > best.inliers || found.success) best = found;
  best.hypotheses = std::move(hypotheses);
}

}  // namespace

RelocalizationReport RelocalizeByPoints(const Frame& frame, const Map& map, const PlaceIndex& index,
                                        const RelocalizationConfig& config, const TrackingConfig& tracking, Rng& rng) {
  const Features& features = *frame.features;
  const LandmarkHits hits = index.Find(features);
  RelocalizationReport best;
  best.why_not = "no place of the map looks like this";
  for (const Place& place : index.RankPlaces(map, hits, kMaxPlaces)) {
    const std::vector<Match> matches = MatchPlace(map, features, place, hits);
    if (static_cast<int>(matches.size()) < kMinMatches) continue;
    const AbsolutePoseReport rough = PoseFromMatches(frame, map, matches, 3 * config.ransac_iterations, rng);
    if (!rough.success) continue;
    std::vector<KeyframeId> around = map.CovisibleKeyframes(place.keyframes.front(), kLocalKeyframes);
    around.push_back(place.keyframes.front());
    RelocalizationReport found = SearchAround(frame, map, LandmarksSeenBy(map, around), rough.cam_from_world);
    found.keyframe = place.keyframes.front();
    Judge(map, tracking.min_relocalization_inliers, tracking.min_relocalization_inliers, found);
    Keep(found, best);
    if (best.success) break;
  }
  std::ranges::stable_sort(best.hypotheses, std::ranges::greater{}, &PoseHypothesis::score);
  return best;
}

RelocalizationReport VerifyByPoints(const Frame& frame, const Map& map, const Rigid3& cam_from_world_guess, double search_radius_px,
                                    const RelocalizationConfig& config, const TrackingConfig& tracking, Rng& rng) {
  const Features& features = *frame.features;
  const std::vector<LandmarkId> all = map.landmarks.Ids();
  const auto projected = ProjectLandmarks(map, all, frame, cam_from_world_guess);
  const auto wide = SearchByProjection(features, map, projected, std::vector<LandmarkId>(features.keypoints.size()),
                                       {search_radius_px, 64, kRatio, false});
  RelocalizationReport report;
  std::vector<Match> matches;
  for (int k = 0; k < features.size(); ++k)
    if (wide.landmarks[k].IsValid())
      matches.push_back({k, wide.landmarks[k], HammingDistance(map.landmarks.At(wide.landmarks[k]).descriptor, features.descriptors[k])});
  std::ranges::stable_sort(matches, {}, &Match::distance);
  const AbsolutePoseReport rough = PoseFromMatches(frame, map, matches, 3 * config.ransac_iterations, rng);
  report = SearchAround(frame, map, all, rough.success ? rough.cam_from_world : cam_from_world_guess);
  Judge(map, tracking.min_relocalization_inliers, config.min_matches, report);
  report.hypotheses.push_back({report.cam_from_world, static_cast<double>(report.inliers)});
  return report;
}

}  // namespace oaslam
