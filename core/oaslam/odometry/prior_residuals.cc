#include "oaslam/odometry/prior_residuals.h"

#include <Eigen/Geometry>
#include <cmath>

namespace oaslam {

std::vector<CamMatrices> CamsOf(const InverseDepthState& state) {
  std::vector<CamMatrices> cams;
  cams.reserve(state.poses.size());
  for (const Rigid3& pose : state.poses)
    cams.push_back({pose.rotation.toRotationMatrix(), pose.translation, pose.OriginInSource()});
  return cams;
}

Eigen::Vector3d ChangeOfVelocity(const VelocityPrior& v, const std::vector<CamMatrices>& cams) {
  return ((cams[v.after].center - cams[v.middle].center) / v.second_s -
          (cams[v.middle].center - cams[v.before].center) / v.first_s) /
         v.sigma;
}

Eigen::Vector3d RotationError(const RotationPrior& r, const std::vector<CamMatrices>& cams) {
  const Eigen::AngleAxisd off(cams[r.second].rotation * cams[r.first].rotation.transpose() *
                              r.turn.second_from_first.toRotationMatrix().transpose());
  return off.angle() / std::sqrt(r.turn.variance) * off.axis();
}

Eigen::Vector3d TurnVector(const CamMatrices& first, const CamMatrices& second) {
  const Eigen::AngleAxisd turn(second.rotation * first.rotation.transpose());
  return turn.angle() * turn.axis();
}

Eigen::Vector3d ChangeOfTurnRate(const TurnRatePrior& t, const std::vector<CamMatrices>& cams) {
  return (TurnVector(cams[t.middle], cams[t.after]) / t.second_s -
          TurnVector(cams[t.before], cams[t.middle]) / t.first_s) /
         t.sigma;
}

std::array<Rigid3, 3> PosesOf(const InertialTriple& t, const InverseDepthState& state) {
  return {state.poses[t.before], state.poses[t.middle], state.poses[t.after]};
}

}  // namespace oaslam
