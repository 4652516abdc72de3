#include "oaslam/matching/place_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "oaslam/estimation/absolute_pose.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/matching/place_matching.h"
#include "oaslam/matching/plane_support.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/matching/projection_search.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

struct Round {
  double radius_px;
  int max_hamming;
  double ratio;
};
// First as wide as the guess may be off (px), then as narrow as the refined pose allows, which
// leaves fewer wrong matches.
constexpr Round kRounds[] = {{12, 80, 0.9}, {6, 80, 0.95}};

// In a wide search around a pose: stricter than in a place, since one view of each landmark counts.
constexpr int kMaxHammingAround = 64;
constexpr double kRatioAround = 0.85;

AbsolutePoseReport PoseFromMatches(const Frame& frame, const std::vector<PlaceMatch>& matches,
                                   int iterations, Rng& rng) {
  std::vector<PointObservation> observations;
  for (const PlaceMatch& m : matches)
    observations.push_back(ObservationOf(*frame.features, m.keypoint, m.position));
  return EstimateAbsolutePose(*frame.camera, observations,
                              {.max_iterations = iterations, .min_inliers = 8}, rng);
}

KeyframeId KeyframeSeeingMost(const Map& map, const std::vector<LandmarkId>& landmarks) {
  std::map<KeyframeId, int> seen;
  for (const LandmarkId id : landmarks)
    for (const Observation& o : map.landmarks.At(id).observations) ++seen[o.keyframe];
  return std::ranges::max_element(seen, {}, [](const auto& k) { return k.second; })->first;
}

// Projects the landmarks that the camera could see from this pose.
std::vector<ProjectedLandmark> ProjectLandmarks(const Map& map,
                                                std::span<const LandmarkId> landmarks,
                                                const Frame& frame, const Rigid3& cam_from_world) {
  std::vector<ProjectedLandmark> projected;
  for (const LandmarkId id : landmarks)
    if (const Landmark* landmark = map.landmarks.Find(id))
      if (const auto p =
              ProjectLandmark(id, *landmark, *frame.camera, cam_from_world, *frame.features))
        projected.push_back(*p);
  return projected;
}

// Of the squares of the image in which landmarks are expected, the share in which some are found.
double CoveredShare(const Features& features, std::span<const ProjectedLandmark> expected,
                    std::span<const LandmarkId> found) {
  constexpr int kAcross = 8;       // squares along the longer side
  constexpr int kFewExpected = 3;  // in a square; none of so few may be found by bad luck
  constexpr int kUnseen = 3;       // added to the squares, so that all of a few do not count much
  const Box& bounds = features.bounds;
  const double side = std::max(bounds.Width(), bounds.Height()) / kAcross;
  const auto square_of = [&](const Eigen::Vector2d& px) {
    const int column = static_cast<int>((px.x() - bounds.x1) / side),
              row = static_cast<int>((px.y() - bounds.y1) / side);
    return std::clamp(row, 0, kAcross - 1) * kAcross + std::clamp(column, 0, kAcross - 1);
  };
  std::array<int, kAcross * kAcross> expected_in{}, found_in{};
  for (const ProjectedLandmark& p : expected) ++expected_in[square_of(p.px)];
  for (size_t k = 0; k < found.size(); ++k)
    if (found[k].IsValid()) ++found_in[square_of(features.keypoints[k].px.cast<double>())];
  int with_expected = 0, covered = 0;
  for (size_t i = 0; i < expected_in.size(); ++i) {
    if (expected_in[i] <= kFewExpected) continue;
    ++with_expected;
    covered += found_in[i] > 0;
  }
  return static_cast<double>(covered) / (with_expected + kUnseen);
}

std::vector<Eigen::Vector3d> Positions(const Map& map, std::span<const LandmarkId> landmarks) {
  std::vector<Eigen::Vector3d> positions;
  for (const LandmarkId id : landmarks)
    if (id.IsValid()) positions.push_back(map.landmarks.At(id).position);
  return positions;
}

double MedianDistance(const Rigid3& cam_from_world, std::span<const Eigen::Vector3d> points) {
  std::vector<double> distances;
  for (const Eigen::Vector3d& x : points) distances.push_back((cam_from_world * x).norm());
  return Median(std::move(distances));
}

bool IsOfOnePlane(const Map& map, const Relocalization& found,
                  std::span<const ProjectedLandmark> expected) {
  const std::vector<Eigen::Vector3d> points = Positions(map, found.points.landmarks);
  std::vector<LandmarkId> ids;
  for (const ProjectedLandmark& p : expected) ids.push_back(p.id);
  return BesideThePlane(points, Positions(map, ids), MedianDistance(found.cam_from_world, points))
      .IsOfOnePlane();
}

}  // namespace

std::vector<LandmarkId> LandmarksAround(const Map& map, KeyframeId place) {
  // They see most landmarks that the image may show.
  constexpr int kLocalKeyframes = 15;
  return LandmarksSeenBy(map, map.KeyframesAround(place, kLocalKeyframes));
}

double ConfidenceOfPoints(const PointSupport& best) {
  constexpr int kFewest = 8;           // three of them fit always
  constexpr double kExpected = 20;     // so that a share of few expected ones does not count much
  constexpr double kExact = 0.02;      // a smaller relative sigma is no better sign
  constexpr double kOfInlier = 0.125;  // few are no more certain than this, whatever their share
  constexpr double kOnePlane = 3.3;  // log odds that a pose of one plane loses: a poster elsewhere
  if (best.inliers < kFewest) return 0;
  // Rooms that are arranged alike agree in some fifty points of hundreds by learned descriptors, so
  // that the share counts more.
  struct Curve {
    double constant, share, covered, sigma;
  };
  constexpr Curve kOrb{3.38, 2.62, 6.11, 3.33}, kLearned{6.12, 3.68, 2.36, 1.34};
  const Curve& curve = best.appearance == Appearance::kOrb ? kOrb : kLearned;
  const double found_share = best.inliers / (best.expected + kExpected);
  const double log_odds = curve.constant + curve.share * std::log(found_share) +
                          curve.covered * std::log(best.covered + 0.05) -
                          curve.sigma * std::log(std::max(best.relative_sigma, kExact));
  const double against = best.is_of_one_plane ? kOnePlane : 0;
  return 1 / (1 + std::exp(against - std::min(log_odds, kOfInlier * best.inliers)));
}

Relocalization SearchAround(const Frame& frame, const Map& map,
                            std::span<const LandmarkId> landmarks, const Rigid3& cam_from_world,
                            Appearance appearance) {
  const Features& features = *frame.features;
  Relocalization found;
  found.cam_from_world = cam_from_world;
  found.points.appearance = appearance;
  for (const Round& round : kRounds) {
    const auto projected = ProjectLandmarks(map, landmarks, frame, found.cam_from_world);
    const auto matches = SearchByProjection(
        features, map, projected, std::vector<LandmarkId>(features.keypoints.size()),
        {round.radius_px, round.max_hamming, round.ratio, false, !features.learned.empty()});
    const MatchedPoints selected = ObserveMatches(features, map, matches.landmarks);
    const PoseReport pose = RefinePose(*frame.camera, found.cam_from_world, selected.observations);
    found.points.inliers = 0;
    found.points.expected = static_cast<int>(projected.size());
    if (!pose.success) return found;
    found.cam_from_world = pose.cam_from_world;
    found.points.inliers = pose.inliers;
    found.covariance = pose.covariance;
    found.points.landmarks.assign(features.keypoints.size(), LandmarkId());
    for (size_t i = 0; i < selected.keypoints.size(); ++i)
      if (pose.inlier[i])
        found.points.landmarks[selected.keypoints[i]] = matches.landmarks[selected.keypoints[i]];
    found.points.covered = CoveredShare(features, projected, found.points.landmarks);
    if (&round == &kRounds[std::size(kRounds) - 1])
      found.points.is_of_one_plane = IsOfOnePlane(map, found, projected);
  }
  Weigh(map, found);
  return found;
}

void Weigh(const Map& map, Relocalization& found, double tolerance) {
  const std::vector<Eigen::Vector3d> points = Positions(map, found.points.landmarks);
  if (points.empty()) return;
  found.points.relative_sigma = found.sigma_position() * std::sqrt(found.points.inliers) /
                                (tolerance * MedianDistance(found.cam_from_world, points));
  found.confidence = ConfidenceOfPoints(found.points);
}

bool IsFlat(const Map& map, const Relocalization& found) {
  const std::vector<Eigen::Vector3d> points = Positions(map, found.points.landmarks);
  return !points.empty() && IsFlat(points, MedianDistance(found.cam_from_world, points));
}

void Judge(double min_confidence, Relocalization& found) {
  found.evidence = found.confidence >= min_confidence ? PoseEvidence::kPoints : PoseEvidence::kNone;
  found.why_not =
      found.IsFound()
          ? ""
          : fmt::format(
                "{} of {} points that should be in view agree with the best pose, in {:.0f} "
                "% of the image{}; position uncertain by {:.0f} % of the distance",
                found.points.inliers, found.points.expected, 100 * found.points.covered,
                found.points.is_of_one_plane ? ", all in one plane" : "",
                100 * found.points.relative_sigma);
}

std::optional<Relocalization> FindAtPlace(const Frame& frame, const Map& map, const Place& place,
                                          Appearance appearance, const PlaceSearchOptions& options,
                                          Rng& rng) {
  const std::vector<PlaceMatch> matches = MatchPlace(*frame.features, map, place, appearance);
  if (static_cast<int>(matches.size()) < kMinMatches) return std::nullopt;
  const AbsolutePoseReport rough = PoseFromMatches(frame, matches, options.ransac_iterations, rng);
  if (!rough.success) return std::nullopt;
  Relocalization found = SearchAround(frame, map, LandmarksAround(map, place.keyframes.front()),
                                      rough.cam_from_world, appearance);
  Judge(options.min_confidence, found);
  return found;
}

Relocalization FindNear(const Frame& frame, const Map& map, std::span<const LandmarkId> landmarks,
                        const Rigid3& guess, double radius_px, const PlaceSearchOptions& options,
                        Rng& rng) {
  const Features& features = *frame.features;
  const auto projected = ProjectLandmarks(map, landmarks, frame, guess);
  const auto wide = SearchByProjection(
      features, map, projected, std::vector<LandmarkId>(features.keypoints.size()),
      {radius_px, kMaxHammingAround, kRatioAround, false, !features.learned.empty()});
  std::vector<PlaceMatch> matches;
  for (int k = 0; k < features.size(); ++k)
    if (wide.landmarks[k].IsValid())
      matches.push_back(
          {k, wide.landmarks[k], map.landmarks.At(wide.landmarks[k]).position, wide.distances[k]});
  std::ranges::stable_sort(matches, {}, &PlaceMatch::distance);
  const AbsolutePoseReport rough = PoseFromMatches(frame, matches, options.ransac_iterations, rng);
  Relocalization found;
  found.why_not = "no landmarks are where this pose would have them";
  std::vector<LandmarkId> agree;
  for (size_t i = 0; i < matches.size(); ++i)
    if (!rough.success || rough.inlier[i]) agree.push_back(matches[i].landmark);
  if (agree.empty()) return found;
  std::vector<LandmarkId> around;
  std::ranges::set_intersection(LandmarksAround(map, KeyframeSeeingMost(map, agree)), landmarks,
                                std::back_inserter(around));
  found = SearchAround(frame, map, around, rough.success ? rough.cam_from_world : guess,
                       features.learned.empty() ? Appearance::kOrb : Appearance::kLearned);
  Judge(options.min_confidence, found);
  found.candidates = {{found.cam_from_world, static_cast<double>(found.points.inliers)}};
  found.candidates_are_by = PoseEvidence::kPoints;
  return found;
}

}  // namespace oaslam
