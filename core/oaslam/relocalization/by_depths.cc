#include "oaslam/relocalization/by_depths.h"

#include <fmt/format.h>

#include <algorithm>

#include "oaslam/map/metre.h"
#include "oaslam/matching/depth_alignment.h"
#include "oaslam/relocalization/confidence.h"

namespace oaslam {

void ApplyDepths(const Frame& frame, const Map& map, Relocalization& found) {
  constexpr double kContradicted = 0.3;  // the most confidence of such a pose; a guess
  if (!frame.depth) return;
  const std::vector<Eigen::Vector3d> landmarks =
      LandmarksBeforeDepths(frame, map, found.cam_from_world);
  if (landmarks.empty()) return;
  const double metre_sigma = SigmaOfMetre(map).value();
  AlignedPose pose{found.cam_from_world, found.covariance};
  if (const auto aligned = AlignToDepths(frame, landmarks, pose, metre_sigma)) pose = *aligned;
  const DepthAgreement agreement = CompareDepths(frame, landmarks, pose, metre_sigma);
  const bool is_by_many_points =
      found.points.inliers > 0 && found.confidence >= kConfidenceThatEndsSearch;
  if (agreement.Contradicts() && !is_by_many_points) {
    found.evidence = PoseEvidence::kNone;
    found.confidence = std::min(found.confidence, kContradicted);
    found.why_not =
        fmt::format("the depth camera sees through {} of {} points that the best pose puts in view",
                    agreement.seen_through, agreement.agree + agreement.seen_through);
    return;
  }
  found.cam_from_world = pose.cam_from_world;
  found.covariance = pose.covariance;
}

}  // namespace oaslam
