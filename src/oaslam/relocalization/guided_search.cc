#include "oaslam/relocalization/guided_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// Where few landmarks are found, at least this share of them must agree with the pose: of the
// matches of a wrong pose, fewer do.
constexpr double kMinShare = 0.4;
// Inliers must exceed this factor times the number expected by chance, plus 8, since the estimate
// of so small a number is uncertain.
constexpr double kChanceFactor = 4;

struct Round {
  double radius_px;
  int max_hamming;
  double ratio;
};
// First as wide as the guess may be off (px), then as narrow as the refined pose allows, which
// leaves fewer wrong matches.
constexpr Round kRounds[] = {{12, 80, 0.9}, {6, 80, 0.95}};

// The number of inliers that a wrong pose would get: the same search with the projections shifted
// far within the image.
double ChanceInliers(const Features& features, const Map& map,
                     std::vector<ProjectedLandmark> projected, const Round& round) {
  // Of the image's sides; arbitrary, but far.
  constexpr double kShifts[][2] = {{0.31, 0.43}, {0.57, 0.23}};
  double sum = 0;
  for (const auto& [shift_x, shift_y] : kShifts) {
    std::vector<ProjectedLandmark> moved = projected;
    const Box& b = features.bounds;
    for (ProjectedLandmark& p : moved)
      p.px = {b.x1 + std::fmod(p.px.x() - b.x1 + shift_x * b.Width(), b.Width()),
              b.y1 + std::fmod(p.px.y() - b.y1 + shift_y * b.Height(), b.Height())};
    const auto matches =
        SearchByProjection(features, map, moved, std::vector<LandmarkId>(features.keypoints.size()),
                           {round.radius_px, round.max_hamming, round.ratio, false});
    // Only part of the matches in the square search window would be inliers, which lie in a circle.
    const double inlier_area = M_PI * kChi2TwoDof / (4 * round.radius_px * round.radius_px);
    sum += matches.count * std::min(1.0, inlier_area);
  }
  return sum / std::size(kShifts);
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

RelocalizationReport SearchAround(const Frame& frame, const Map& map,
                                  std::span<const LandmarkId> landmarks,
                                  const Rigid3& cam_from_world) {
  const Features& features = *frame.features;
  RelocalizationReport report;
  report.cam_from_world = cam_from_world;
  for (const Round& round : kRounds) {
    const auto projected = ProjectLandmarks(map, landmarks, frame, report.cam_from_world);
    const auto matches = SearchByProjection(
        features, map, projected, std::vector<LandmarkId>(features.keypoints.size()),
        {round.radius_px, round.max_hamming, round.ratio, false});
    const MatchedPoints selected = ObserveMatches(features, map, matches.landmarks);
    const PoseReport pose =
        RefinePose(map.cameras[frame.camera], report.cam_from_world, selected.observations);
    report.inliers = 0;
    report.expected = static_cast<int>(projected.size());
    if (!pose.success) return report;
    report.cam_from_world = pose.cam_from_world;
    report.inliers = pose.inliers;
    report.inlier_share = static_cast<double>(pose.inliers) / matches.count;
    report.covariance = pose.covariance;
    report.sigma_position = SigmaOfPosition(pose.covariance);
    report.landmarks.assign(features.keypoints.size(), LandmarkId());
    for (size_t i = 0; i < selected.keypoints.size(); ++i)
      if (pose.inlier[i])
        report.landmarks[selected.keypoints[i]] = matches.landmarks[selected.keypoints[i]];
    report.chance_inliers = ChanceInliers(features, map, projected, round);
  }
  return report;
}

void Judge(const Map& map, int enough_inliers, int few_inliers, RelocalizationReport& report,
           double max_relative_sigma) {
  report.success = false;
  if (report.inliers < few_inliers) {
    report.why_not = fmt::format("{} points agree with the best pose", report.inliers);
    return;
  }
  const double by_chance = kChanceFactor * report.chance_inliers + 8;
  if (report.inliers < by_chance) {
    report.why_not = fmt::format("{} points agree, chance alone would give {:.0f}", report.inliers,
                                 report.chance_inliers);
    return;
  }
  if (report.inliers < enough_inliers && report.inlier_share < kMinShare) {
    report.why_not = fmt::format("only {:.0f} % of {:.0f} matches agree", 100 * report.inlier_share,
                                 report.inliers / report.inlier_share);
    return;
  }
  std::vector<double> distances;
  for (const LandmarkId id : report.landmarks)
    if (id.IsValid())
      distances.push_back((report.cam_from_world * map.landmarks.At(id).position).norm());
  const double distance = Median(std::move(distances));
  const double correlated_sigma = report.sigma_position * std::sqrt(report.inliers);
  if (!(correlated_sigma < max_relative_sigma * distance)) {
    report.why_not = fmt::format("position uncertain by {:.0f} % of the distance",
                                 100 * correlated_sigma / distance);
    return;
  }
  report.success = true;
  report.why_not.clear();
}

}  // namespace oaslam
