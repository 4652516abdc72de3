#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"

// This header has cameras, poses that look at a target, and the distances between their centers.
namespace oaslam {
namespace synthetic {

inline const Camera kCamera{
    .width = 640, .height = 480, .fx = 520, .fy = 520, .cx = 320, .cy = 240};
// These lenses distort, and their focal lengths along the two axes differ.
inline const Camera kPinhole{.width = 640,
                             .height = 480,
                             .fx = 520.9,
                             .fy = 531.0,
                             .cx = 325.1,
                             .cy = 249.7,
                             .distortion = {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}};
inline const Camera kFisheye{.model = LensModel::kFisheye,
                             .width = 848,
                             .height = 800,
                             .fx = 286,
                             .fy = 287,
                             .cx = 420,
                             .cy = 401,
                             .distortion = {-0.0076, 0.0418, -0.0394, 0.0069, 0}};
inline const Eigen::Vector3d kUp(0, 0, 1);

// A camera at `center` that looks at `target`, upright (y down, world z up).
inline Rigid3 LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - center).normalized(), x = z.cross(kUp).normalized();
  Eigen::Matrix3d world_from_cam;
  world_from_cam << x, z.cross(x), z;
  return Rigid3(world_from_cam, center).Inverse();
}

}  // namespace synthetic

inline double CenterDistance(const Rigid3& a, const Rigid3& b) {
  return (a.OriginInSource() - b.OriginInSource()).norm();
}

struct CenterErrors {
  double rms = 0, worst = 0;
};

// `is_aligned`: the best similarity (Umeyama 1991) moves the poses to the true ones first.
inline CenterErrors CenterErrorsOf(const std::vector<Rigid3>& poses,
                                   const std::vector<Rigid3>& truth, bool is_aligned = false) {
  const auto centers_of = [](const std::vector<Rigid3>& all) {
    Eigen::Matrix3Xd centers(3, all.size());
    for (size_t i = 0; i < all.size(); ++i) centers.col(i) = all[i].OriginInSource();
    return centers;
  };
  Eigen::Matrix3Xd estimate = centers_of(poses);
  const Eigen::Matrix3Xd expected = centers_of(truth);
  if (is_aligned) {
    const Eigen::Matrix4d sim = Eigen::umeyama(estimate, expected, true);
    estimate =
        ((sim.topLeftCorner<3, 3>() * estimate).colwise() + sim.topRightCorner<3, 1>()).eval();
  }
  const Eigen::RowVectorXd errors = (estimate - expected).colwise().norm();
  return {std::sqrt(errors.squaredNorm() / static_cast<double>(errors.size())), errors.maxCoeff()};
}

}  // namespace oaslam
