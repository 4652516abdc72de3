#include "oaslam/relocalization/guided_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/relocalization/confidence.h"
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

}  // namespace

std::vector<ProjectedLandmark> ProjectLandmarks(const Map& map,
                                                std::span<const LandmarkId> landmarks,
                                                const Frame& frame, const Rigid3& cam_from_world) {
  std::vector<ProjectedLandmark> projected;
  for (const LandmarkId id : landmarks)
    if (const Landmark* landmark = map.landmarks.Find(id))
      if (const auto p = ProjectLandmark(id, *landmark, map.cameras[frame.camera], cam_from_world,
                                         *frame.features))
        projected.push_back(*p);
  return projected;
}

Relocalization SearchAround(const Frame& frame, const Map& map,
                            std::span<const LandmarkId> landmarks, const Rigid3& cam_from_world) {
  const Features& features = *frame.features;
  Relocalization found;
  found.cam_from_world = cam_from_world;
  for (const Round& round : kRounds) {
    const auto projected = ProjectLandmarks(map, landmarks, frame, found.cam_from_world);
    const auto matches = SearchByProjection(
        features, map, projected, std::vector<LandmarkId>(features.keypoints.size()),
        {round.radius_px, round.max_hamming, round.ratio, false, !features.learned.empty()});
    const MatchedPoints selected = ObserveMatches(features, map, matches.landmarks);
    const PoseReport pose =
        RefinePose(map.cameras[frame.camera], found.cam_from_world, selected.observations);
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
  }
  Weigh(map, found);
  return found;
}

void Weigh(const Map& map, Relocalization& found, double tolerance) {
  std::vector<double> distances;
  for (const LandmarkId id : found.points.landmarks)
    if (id.IsValid())
      distances.push_back((found.cam_from_world * map.landmarks.At(id).position).norm());
  if (distances.empty()) return;
  found.points.relative_sigma = found.sigma_position() * std::sqrt(found.points.inliers) /
                                (tolerance * Median(std::move(distances)));
  found.confidence = ConfidenceOfPoints(found.points);
}

void Judge(double min_confidence, Relocalization& found) {
  found.evidence = found.confidence >= min_confidence ? PoseEvidence::kPoints : PoseEvidence::kNone;
  found.why_not =
      found.IsFound()
          ? ""
          : fmt::format(
                "{} of {} points that should be in view agree with the best pose, in {:.0f} "
                "% of the image; position uncertain by {:.0f} % of the distance",
                found.points.inliers, found.points.expected, 100 * found.points.covered,
                100 * found.points.relative_sigma);
}

}  // namespace oaslam
