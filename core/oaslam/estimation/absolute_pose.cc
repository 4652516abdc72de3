#include "oaslam/estimation/absolute_pose.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/p3p.h"

namespace oaslam {
namespace {

// Sum of min(chi^2, max); stops once it exceeds `enough`.
double Cost(const Camera& camera, const Rigid3& pose,
            std::span<const PointObservation> observations, double max_chi2, double enough) {
  const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
  double sum = 0;
  for (const PointObservation& o : observations) {
    const Eigen::Vector3d p = r * o.point + pose.translation;
    const double chi2 =
        p.z() > 0 ? (ProjectIdeal(camera, p) - o.px).squaredNorm() * o.inverse_variance : max_chi2;
    sum += chi2 < max_chi2 ? chi2 : max_chi2;
    if (sum > enough) break;
  }
  return sum;
}

std::vector<uint8_t> Inliers(const Camera& camera, const Rigid3& pose,
                             std::span<const PointObservation> observations, double max_chi2) {
  std::vector<uint8_t> inlier;
  inlier.reserve(observations.size());
  for (const PointObservation& o : observations) {
    const Eigen::Vector3d p = pose * o.point;
    inlier.push_back(p.z() > 0 &&
                     (ProjectIdeal(camera, p) - o.px).squaredNorm() * o.inverse_variance <
                         max_chi2);
  }
  return inlier;
}

Rigid3 RefinedOnInliers(const Camera& camera, const Rigid3& pose,
                        std::span<const PointObservation> observations, double max_chi2) {
  const std::vector<uint8_t> inlier = Inliers(camera, pose, observations, max_chi2);
  std::vector<PointObservation> kept;
  for (size_t i = 0; i < observations.size(); ++i)
    if (inlier[i]) kept.push_back(observations[i]);
  const PoseReport refined = RefinePose(camera, pose, kept);
  return refined.success ? refined.cam_from_world : pose;
}

// The number of samples of three points of which, with 99 % probability, at least one has inliers
// only; doubled, since noise spoils samples, too.
int IterationsFor(double inlier_share) {
  const double all_inliers = std::pow(std::clamp(inlier_share, 1e-3, 0.99), 3);
  return static_cast<int>(std::min(1e6, 2 * std::ceil(std::log(0.01) / std::log(1 - all_inliers))));
}

}  // namespace

AbsolutePoseReport EstimateAbsolutePose(const Camera& camera,
                                        std::span<const PointObservation> observations,
                                        const AbsolutePoseOptions& options, Rng& rng) {
  const int n = static_cast<int>(observations.size());
  AbsolutePoseReport report;
  report.inlier.assign(observations.size(), 0);
  if (n < std::max(4, options.min_inliers)) return report;
  std::vector<Eigen::Vector3d> rays;
  for (const PointObservation& o : observations) rays.push_back(RayOf(camera, o.px).normalized());

  double best_cost = options.max_chi2 * (n - 3);  // the three points of a sample always fit
  bool found = false;
  int needed = options.max_iterations;
  for (int iteration = 0; iteration < needed; ++iteration) {
    // Samples are drawn from the front fifth (of at least 12 points) at first, and from all points
    // after half of the iterations.
    const int front = std::min(n, std::max(12, n / 5) + 2 * n * iteration / options.max_iterations);
    std::array<int, 3> s{rng.Index(front), rng.Index(front), rng.Index(front)};
    if (s[0] == s[1] || s[0] == s[2] || s[1] == s[2]) continue;
    const P3PPoses candidates =
        SolveP3P({rays[s[0]], rays[s[1]], rays[s[2]]},
                 {observations[s[0]].point, observations[s[1]].point, observations[s[2]].point});
    bool improved = false;
    for (int c = 0; c < candidates.count; ++c) {
      const double cost =
          Cost(camera, candidates.poses[c], observations, options.max_chi2, best_cost);
      if (!(cost < best_cost)) continue;
      best_cost = cost;
      report.cam_from_world = candidates.poses[c];
      improved = found = true;
    }
    if (!improved) continue;
    // The first refinement takes twice the distance as its bound: the pose of three noisy points is
    // near to few of its inliers.
    const Rigid3 rough =
        RefinedOnInliers(camera, report.cam_from_world, observations, 4 * options.max_chi2);
    const Rigid3 refined = RefinedOnInliers(camera, rough, observations, options.max_chi2);
    if (const double cost = Cost(camera, refined, observations, options.max_chi2, best_cost);
        cost < best_cost) {
      best_cost = cost;
      report.cam_from_world = refined;
    }
    const double inlier_share = 1 - best_cost / (options.max_chi2 * n);
    needed = std::min(options.max_iterations, iteration + 1 + IterationsFor(inlier_share));
  }
  if (!found) return report;
  report.inlier = Inliers(camera, report.cam_from_world, observations, options.max_chi2);
  report.inliers = static_cast<int>(std::ranges::count(report.inlier, 1));
  report.success = report.inliers >= options.min_inliers;
  return report;
}

}  // namespace oaslam
