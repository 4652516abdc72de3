#include "oaslam/estimation/triangulation.h"

#include <algorithm>

namespace oaslam {

std::optional<TriangulatedPoint> TriangulateRays(const Rigid3& second_from_first,
                                                 const Eigen::Vector3d& ray_first,
                                                 const Eigen::Vector3d& ray_second) {
  const Eigen::Vector3d& t = second_from_first.translation;
  const Eigen::Vector3d f0 = second_from_first.rotation * ray_first.normalized(),
                        f1 = ray_second.normalized();
  const double p = f0.cross(f1).norm();
  if (!(p > 1e-9)) return std::nullopt;
  const double q = f0.cross(t).norm(), r = f1.cross(t).norm();
  const Eigen::Vector3d on_first = (r / p) * f0, on_second = (q / p) * f1;
  // Of the four combinations of signs of the depths, positive depths must bring the rays closest
  // together (eq. 9 of the paper).
  const double agreement = (t + on_first - on_second).squaredNorm();
  const double best_wrong =
      std::min({(t + on_first + on_second).squaredNorm(), (t - on_first - on_second).squaredNorm(),
                (t - on_first + on_second).squaredNorm()});
  if (!(agreement < best_wrong)) return std::nullopt;
  const Eigen::Vector3d in_second = q / (q + r) * (t + (r / p) * (f0 + f1));
  const Eigen::Vector3d in_first = second_from_first.rotation.conjugate() * (in_second - t);
  if (!in_first.allFinite()) return std::nullopt;
  return TriangulatedPoint{in_first, f0.dot(f1)};
}

std::optional<TriangulatedPoint> TriangulateRays(const Rigid3& first_from_world,
                                                 const Rigid3& second_from_world,
                                                 const Eigen::Vector3d& ray_first,
                                                 const Eigen::Vector3d& ray_second) {
  const Rigid3 world_from_first = first_from_world.Inverse();
  auto result = TriangulateRays(second_from_world * world_from_first, ray_first, ray_second);
  if (result) result->point = world_from_first * result->point;
  return result;
}

}  // namespace oaslam
