#include "oaslam/estimation/two_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/estimation/triangulation.h"
#include "oaslam/estimation/two_view_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// With less parallax the depth of a point is not determined.
constexpr double kMinPointParallaxDeg = 0.3;
// Largest share of inliers that may lie behind a camera. Noise puts some of the farthest points
// there, a wrong motion many points.
constexpr double kMaxBehindShare = 0.15;

// The points that a motion gives for the matches.
struct Structure {
  std::vector<std::optional<Eigen::Vector3d>> points;  // in the first camera
  std::vector<double> parallax_deg;                    // of the points
  int inliers = 0;                                     // of the epipolar geometry
  // Inliers with parallax whose triangulated point is behind a camera or far from a key point.
  int behind = 0;
};

// Triangulates all matches with a motion.
Structure Explain(const RayMatches& m, const Rigid3& motion) {
  const Eigen::Matrix3d essential = EssentialOf(motion);
  Structure s;
  s.points.resize(m.size());
  const double min_cos = std::cos(kMinPointParallaxDeg * std::numbers::pi / 180);
  for (int i = 0; i < m.size(); ++i) {
    // The bound on a triangulated point's error in each image: two sigmas.
    const double variance = m.sigma[i] * m.sigma[i], max_error2 = 4 * variance;
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
  }
  return s;
}

// The largest value that at least `count` of the values reach; 0 where there are fewer values.
double Reached(std::vector<double> values, int count) {
  if (static_cast<int>(values.size()) < count) return 0;
  const auto place = values.begin() + (count - 1);
  std::ranges::nth_element(values, place, std::ranges::greater{});
  return *place;
}

// Why the points are not reliable; empty if they are.
std::string WhyNot(const TwoViewReport& report, const Structure& best, int matches,
                   const TwoViewOptions& options) {
  if (best.inliers < options.min_inlier_share * matches)
    return fmt::format("{} of {} matches agree with the motion", best.inliers, matches);
  if (report.triangulated < options.min_points)
    return fmt::format("{} points triangulated", report.triangulated);
  if (report.parallax_deg < options.min_parallax_deg)
    return fmt::format("parallax of {:.2f} degrees", report.parallax_deg);
  if (best.behind > kMaxBehindShare * best.inliers)
    return fmt::format("{} of {} points behind a camera", best.behind, best.inliers);
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

TwoViewReport TriangulateTwoViews(const Camera& camera_first, const Camera& camera_second,
                                  std::span<const Eigen::Vector2d> px_first,
                                  std::span<const Eigen::Vector2d> px_second,
                                  std::span<const double> sigma_px, const Rigid3& second_from_first,
                                  const TwoViewOptions& options) {
  OASLAM_CHECK(px_first.size() == px_second.size() && px_first.size() == sigma_px.size());
  TwoViewReport report;
  report.points.resize(px_first.size());
  const RayMatches matches = MakeRays(camera_first, camera_second, px_first, px_second, sigma_px);
  if (matches.size() < std::max(8, options.min_points)) {
    report.why_not = fmt::format("{} matches", matches.size());
    return report;
  }
  const double way = second_from_first.translation.norm();
  constexpr double kNoWay = 1e-9;
  if (!(way > kNoWay)) {
    report.why_not = "the camera only turned";
    return report;
  }
  const RefinedMotion motion = RefineMotion(
      matches, Rigid3(second_from_first.rotation, second_from_first.translation / way));
  Structure seen = Explain(matches, motion.second_from_first);
  report.second_from_first = motion.second_from_first;
  report.direction_sigma_deg = motion.direction_sigma_deg;
  report.inliers = seen.inliers;
  report.triangulated = static_cast<int>(seen.parallax_deg.size());
  report.parallax_deg = Reached(seen.parallax_deg, options.min_points);
  report.why_not = WhyNot(report, seen, matches.size(), options);
  report.success = report.why_not.empty();
  report.points = std::move(seen.points);
  return report;
}

}  // namespace oaslam
