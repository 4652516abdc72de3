#include "oaslam/estimation/two_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/estimation/triangulation.h"
#include "oaslam/estimation/two_view_models.h"
#include "oaslam/estimation/two_view_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// With less parallax the depth of a point is not determined.
constexpr double kMinPointParallaxDeg = 0.3;
// The scene counts as planar when the homography's share of the scores, S_H / (S_H + S_E), is
// larger (Mur-Artal et al. 2015, IV).
constexpr double kPlanarShare = 0.45;
// Largest share of inliers that may lie behind a camera. Noise puts some of the farthest points
// there, a wrong motion many points.
constexpr double kMaxBehindShare = 0.15;
// Candidates with a rough score below this share of the best are not refined: it spares time, and
// may miss one that refinement would make the best.
constexpr double kWorthRefining = 0.3;

// The points that a motion gives for the matches.
struct Structure {
  std::vector<std::optional<Eigen::Vector3d>> points;  // in the first camera
  std::vector<double> parallax_deg;                    // of the points
  int inliers = 0;                                     // of the epipolar geometry
  // Inliers with parallax whose triangulated point is behind a camera or far from a key point.
  int behind = 0;
  double score = 0;  // sum over the points of 5.991 - chi^2
};

// Triangulates all matches with a motion; `loose` multiplies the sigmas.
Structure Explain(const RayMatches& m, const Rigid3& motion, double loose) {
  const Eigen::Matrix3d essential = EssentialOf(motion);
  Structure s;
  s.points.resize(m.size());
  const double min_cos = std::cos(kMinPointParallaxDeg * std::numbers::pi / 180);
  for (int i = 0; i < m.size(); ++i) {
    // The bound on a triangulated point's error in each image: two sigmas.
    const double variance = std::pow(loose * m.sigma[i], 2), max_error2 = 4 * variance;
    const double chi2 = SquaredSampson(m, essential, i) / variance;
    if (!(chi2 < kChi2OneDof)) continue;
    ++s.inliers;
    const double cos_rays =
        (motion.rotation * m.first[i]).normalized().dot(m.second[i].normalized());
    if (cos_rays > min_cos) continue;
    const auto found = TriangulateRays(motion, m.first[i], m.second[i]);
    const bool sound = found && [&] {
      const Eigen::Vector3d& x = found->point;
      const Eigen::Vector3d y = motion * x;
      return x.z() > 0 && y.z() > 0 &&
             (x.head<2>() / x.z() - m.first[i].head<2>()).squaredNorm() *
                     std::pow(m.focal_first, 2) <=
                 max_error2 &&
             (y.head<2>() / y.z() - m.second[i].head<2>()).squaredNorm() *
                     std::pow(m.focal_second, 2) <=
                 max_error2;
    }();
    if (!sound) {
      ++s.behind;
      continue;
    }
    s.points[i] = found->point;
    s.parallax_deg.push_back(std::acos(std::clamp(found->cos_parallax, -1.0, 1.0)) * 180 /
                             std::numbers::pi);
    s.score += kChi2TwoDof - chi2;
  }
  return s;
}

struct Candidate {
  RefinedMotion motion;
  Structure structure;
};

// The direction of translation is less certain than the rotation (max_direction_sigma_deg).
bool SameMotion(const Rigid3& a, const Rigid3& b) {
  return a.rotation.angularDistance(b.rotation) < kDegree &&
         a.translation.dot(b.translation) > std::cos(5 * kDegree);
}

// Refines the candidates and returns them best first, each distinct motion once.
std::vector<Candidate> RankMotions(const RayMatches& matches, const std::vector<Rigid3>& motions) {
  std::vector<double> rough;  // a rough score decides which motions are refined
  for (const Rigid3& motion : motions) rough.push_back(Explain(matches, motion, 2).score);
  const double best = rough.empty() ? 0 : *std::ranges::max_element(rough);
  std::vector<Candidate> ranked;
  for (size_t i = 0; i < motions.size(); ++i) {
    if (!(rough[i] > kWorthRefining * best)) continue;
    const RefinedMotion refined = RefineMotion(matches, motions[i]);
    ranked.push_back({refined, Explain(matches, refined.second_from_first, 1)});
  }
  std::ranges::stable_sort(ranked, std::ranges::greater{},
                           [](const Candidate& c) { return c.structure.score; });
  std::vector<Candidate> distinct;
  for (Candidate& c : ranked)
    if (std::ranges::none_of(distinct, [&](const Candidate& d) {
          return SameMotion(c.motion.second_from_first, d.motion.second_from_first);
        }))
      distinct.push_back(std::move(c));
  return distinct;
}

// The largest value that at least `count` of the values reach; 0 where there are fewer values.
double Reached(std::vector<double> values, int count) {
  if (static_cast<int>(values.size()) < count) return 0;
  const auto place = values.begin() + (count - 1);
  std::ranges::nth_element(values, place, std::ranges::greater{});
  return *place;
}

// Why the best candidate is not reliable; empty if it is.
std::string WhyNot(const TwoViewReport& report, const std::vector<Candidate>& ranked, int matches,
                   const TwoViewOptions& options) {
  const Structure& best = ranked.front().structure;
  if (best.inliers < options.min_inlier_share * matches)
    return fmt::format("{} of {} matches agree with the motion", best.inliers, matches);
  if (report.triangulated < options.min_points)
    return fmt::format("{} points triangulated", report.triangulated);
  if (report.parallax_deg < options.min_parallax_deg)
    return fmt::format("parallax of {:.2f} degrees", report.parallax_deg);
  if (best.behind > kMaxBehindShare * best.inliers)
    return fmt::format("{} of {} points behind a camera", best.behind, best.inliers);
  if (report.rival > options.max_rival)
    return fmt::format("two motions explain the matches ({:.0f} % of the best)",
                       100 * report.rival);
  if (report.direction_sigma_deg > options.max_direction_sigma_deg)
    return fmt::format("direction of motion uncertain by {:.1f} degrees",
                       report.direction_sigma_deg);
  return {};
}

RayMatches MakeRays(const Camera& camera_first, const Camera& camera_second,
                    std::span<const Eigen::Vector2d> px_first,
                    std::span<const Eigen::Vector2d> px_second, std::span<const double> sigma_px) {
  RayMatches m;
  m.sigma.assign(sigma_px.begin(), sigma_px.end());
  m.focal_first = (camera_first.fx + camera_first.fy) / 2;
  m.focal_second = (camera_second.fx + camera_second.fy) / 2;
  for (size_t i = 0; i < px_first.size(); ++i) {
    m.first.push_back(RayOf(camera_first, px_first[i]));
    m.second.push_back(RayOf(camera_second, px_second[i]));
  }
  return m;
}

}  // namespace

// Motions of both models are candidates: on a plane the essential matrix of eight points is
// arbitrary, and off a plane a homography's motion is rough. After refinement with all matches they
// are comparable, and the second of a plane's two motions appears as a rival.
std::vector<Rigid3> MotionsOfModels(const RayMatches& matches, const TwoViewOptions& options,
                                    Rng& rng, bool& is_planar) {
  const TwoViewModel homography = FitHomography(matches, options.homography_iterations, rng);
  const TwoViewModel essential = FitEssential(matches, options.essential_iterations, rng);
  is_planar = homography.score > kPlanarShare * (homography.score + essential.score);
  std::vector<Rigid3> motions;
  if (homography.score > 0) motions = MotionsOfHomography(homography.matrix, matches);
  if (essential.score > 0)
    std::ranges::copy(MotionsOfEssential(essential.matrix), std::back_inserter(motions));
  return motions;
}

TwoViewReport EstimateTwoView(const Camera& camera_first, const Camera& camera_second,
                              std::span<const Eigen::Vector2d> px_first,
                              std::span<const Eigen::Vector2d> px_second,
                              std::span<const double> sigma_px, const TwoViewOptions& options,
                              Rng& rng) {
  OASLAM_CHECK(px_first.size() == px_second.size() && px_first.size() == sigma_px.size());
  TwoViewReport report;
  report.points.resize(px_first.size());
  const RayMatches matches = MakeRays(camera_first, camera_second, px_first, px_second, sigma_px);
  if (matches.size() < std::max(8, options.min_points)) {
    report.why_not = fmt::format("{} matches", matches.size());
    return report;
  }
  std::vector<Rigid3> motions;
  if (options.known_motion) {
    const Rigid3& known = *options.known_motion;
    motions = {Rigid3(known.rotation, known.translation.normalized())};
  } else {
    motions = MotionsOfModels(matches, options, rng, report.planar);
  }
  std::vector<Candidate> ranked = RankMotions(matches, motions);
  if (ranked.empty()) {
    report.why_not = "no motion has points in front of both cameras";
    return report;
  }
  const Candidate& best = ranked.front();
  report.second_from_first = best.motion.second_from_first;
  report.direction_sigma_deg = best.motion.direction_sigma_deg;
  report.inliers = best.structure.inliers;
  report.triangulated = static_cast<int>(best.structure.parallax_deg.size());
  report.parallax_deg = Reached(best.structure.parallax_deg, options.min_points);
  report.rival = ranked.size() > 1 && best.structure.score > 0
                     ? ranked[1].structure.score / best.structure.score
                     : 0;
  report.why_not = WhyNot(report, ranked, matches.size(), options);
  report.success = report.why_not.empty();
  report.points = best.structure.points;
  return report;
}

}  // namespace oaslam
