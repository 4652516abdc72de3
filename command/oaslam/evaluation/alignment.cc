#include "oaslam/evaluation/alignment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace oaslam {

const StampedPose* NearestInTime(const std::vector<StampedPose>& poses, double timestamp,
                                 double max_difference) {
  if (poses.empty()) return nullptr;
  auto nearest = std::ranges::lower_bound(poses, timestamp, {}, &StampedPose::timestamp);
  if (nearest == poses.end() || (nearest != poses.begin() && timestamp - (nearest - 1)->timestamp <
                                                                 nearest->timestamp - timestamp))
    --nearest;
  return std::abs(nearest->timestamp - timestamp) <= max_difference ? &*nearest : nullptr;
}

std::vector<AssociatedPair> Associate(const std::vector<StampedPose>& reference,
                                      const std::vector<StampedPose>& query,
                                      double max_difference) {
  std::vector<AssociatedPair> pairs;
  for (size_t q = 0; q < query.size(); ++q)
    if (const auto* nearest = NearestInTime(reference, query[q].timestamp, max_difference))
      pairs.push_back({static_cast<size_t>(nearest - reference.data()), q});
  return pairs;
}

std::vector<StampedPose> WithoutDuplicates(const std::vector<StampedPose>& poses) {
  std::vector<StampedPose> result;
  for (const StampedPose& pose : poses) {
    if (!result.empty() && result.back().timestamp == pose.timestamp) result.pop_back();
    result.push_back(pose);
  }
  return result;
}

std::vector<StampedPose> Aligned(std::vector<StampedPose> poses,
                                 const Alignment& reference_from_query) {
  for (StampedPose& pose : poses) pose.world_from_cam = reference_from_query * pose.world_from_cam;
  return poses;
}

std::optional<Alignment> AlignPositions(const std::vector<StampedPose>& reference,
                                        const std::vector<StampedPose>& query,
                                        const std::vector<AssociatedPair>& pairs, AlignMode mode) {
  if (mode == AlignMode::kNone) return Alignment();
  if (pairs.size() < 3) return std::nullopt;
  Eigen::Matrix3Xd from(3, pairs.size()), to(3, pairs.size());
  for (size_t i = 0; i < pairs.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = query[pairs[i].query].world_from_cam.translation;
    to.col(static_cast<Eigen::Index>(i)) = reference[pairs[i].reference].world_from_cam.translation;
  }
  const double spread = (from.colwise() - from.rowwise().mean()).norm();
  if (!(spread > 1e-9)) return std::nullopt;
  const Eigen::Matrix4d similarity = Eigen::umeyama(from, to, mode == AlignMode::kSim3);
  Alignment alignment;
  alignment.scale = mode == AlignMode::kSim3 ? similarity.topLeftCorner<3, 3>().col(0).norm() : 1.0;
  if (!(alignment.scale > 0)) return std::nullopt;
  alignment.rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(similarity.topLeftCorner<3, 3>() / alignment.scale))
          .normalized();
  alignment.translation = similarity.topRightCorner<3, 1>();
  return alignment;
}

PoseError ErrorOf(const StampedPose& reference, const StampedPose& query,
                  const Alignment& reference_from_query) {
  const Rigid3 aligned = reference_from_query * query.world_from_cam;
  return {
      query.timestamp, (aligned.translation - reference.world_from_cam.translation).norm(),
      aligned.rotation.angularDistance(reference.world_from_cam.rotation) * 180 / std::numbers::pi};
}

}  // namespace oaslam
