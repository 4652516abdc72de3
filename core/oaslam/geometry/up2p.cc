#include "oaslam/geometry/up2p.h"

#include <cmath>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/polynomial.h"

namespace oaslam {

Up2PPoses SolveUp2P(const std::array<Eigen::Vector3d, 2>& rays, const Eigen::Vector3d& up_in_cam,
                    const std::array<Eigen::Vector3d, 2>& points,
                    const Eigen::Vector3d& up_in_world) {
  Up2PPoses result;
  // In frames whose z axis is up, D2 u2 - D1 u1 = Rz(yaw) (P2 - P1): the vertical part gives D2
  // from D1, the length of the horizontal part a quadratic in D1. The steeper ray is the second,
  // which divides.
  const auto upright_from_cam = TurnBetween(up_in_cam, Eigen::Vector3d::UnitZ());
  const auto upright_from_world = TurnBetween(up_in_world, Eigen::Vector3d::UnitZ());
  const std::array<Eigen::Vector3d, 2> upright = {upright_from_cam * rays[0],
                                                  upright_from_cam * rays[1]};
  const int second =
      std::abs(upright[1].z()) * upright[0].norm() >= std::abs(upright[0].z()) * upright[1].norm()
          ? 1
          : 0;
  const int first = 1 - second;
  const Eigen::Vector3d &u1 = upright[first], &u2 = upright[second];
  const Eigen::Vector3d between = upright_from_world * (points[second] - points[first]);
  const double horizontal = between.head<2>().squaredNorm();
  if (!(std::abs(u2.z()) > 1e-3 * u2.norm()) || !(horizontal > 1e-9 * between.squaredNorm()))
    return result;

  // D2 u2xy - D1 u1xy = offset + D1 slope.
  const Eigen::Vector2d offset = u2.head<2>() * (between.z() / u2.z());
  const Eigen::Vector2d slope = u2.head<2>() * (u1.z() / u2.z()) - u1.head<2>();
  const RealRoots2 roots =
      SolveQuadratic(slope.squaredNorm(), 2 * offset.dot(slope), offset.squaredNorm() - horizontal);
  for (int r = 0; r < roots.count; ++r) {
    const double d1 = roots.roots[r], d2 = (between.z() + d1 * u1.z()) / u2.z();
    if (!(d1 > 0) || !(d2 > 0)) continue;
    const Eigen::Vector2d seen = offset + d1 * slope;
    const double yaw = std::atan2(seen.y(), seen.x()) - std::atan2(between.y(), between.x());
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
    const Eigen::Quaterniond cam_from_world =
        (upright_from_cam.conjugate() * turn * upright_from_world).normalized();
    result.poses[result.count++] =
        Rigid3(cam_from_world, d1 * rays[first] - cam_from_world * points[first]);
  }
  return result;
}

}  // namespace oaslam
