#include "oaslam/objects/upright.h"

#include <Eigen/Eigenvalues>

namespace oaslam {

std::optional<Eigen::Vector3d> EstimateUp(const Map& map) {
  constexpr size_t kEnough = 200;  // keyframes that are looked at, evenly
  constexpr size_t kMinKeyframes = 5;
  constexpr double kMinTurn = 0.03;     // variance of the x axes in the second direction: about 10 deg of yaw
  constexpr double kMinSeparation = 8;  // over that in the upright direction, which is roll
  const size_t stride = map.keyframes.size() / kEnough + 1;
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rough_up = Eigen::Vector3d::Zero();
  size_t index = 0, count = 0;
  map.keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    if (index++ % stride != 0) return;
    const Eigen::Matrix3d cam_from_world = keyframe.cam_from_world.rotation.toRotationMatrix();
    moment += cam_from_world.row(0).transpose() * cam_from_world.row(0);
    rough_up -= cam_from_world.row(1).transpose();
    ++count;
  });
  if (count < kMinKeyframes) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moment / static_cast<double>(count));
  const Eigen::Vector3d& values = solver.eigenvalues();
  if (values[1] < kMinTurn || values[1] < kMinSeparation * values[0]) return std::nullopt;
  const Eigen::Vector3d up = solver.eigenvectors().col(0);
  return up.dot(rough_up) < 0 ? Eigen::Vector3d(-up) : up;
}

}  // namespace oaslam
