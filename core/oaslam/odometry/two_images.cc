#include "oaslam/odometry/two_images.h"

namespace oaslam {

RayMatches MatchesBetween(const Window& window, int first, int second,
                          const WindowOptions& options) {
  RayMatches matches;
  matches.focal_first = matches.focal_second = options.focal_px;
  for (const WindowPoint& p : window.points) {
    const Eigen::Vector2d *before = p.RayIn(first), *now = before ? p.RayIn(second) : nullptr;
    if (!now) continue;
    matches.first.push_back(before->homogeneous());
    matches.second.push_back(now->homogeneous());
    matches.sigma.push_back(options.sigma_px);
  }
  return matches;
}

std::vector<Rigid3> MotionsBetween(const RayMatches& matches, int of_essential, int of_homography,
                                   Rng& rng) {
  std::vector<Rigid3> motions = MotionsOfEssential(FitEssential(matches, of_essential, rng).matrix);
  for (const Rigid3& m :
       MotionsOfHomography(FitHomography(matches, of_homography, rng).matrix, matches))
    motions.push_back(m);
  return motions;
}

}  // namespace oaslam
