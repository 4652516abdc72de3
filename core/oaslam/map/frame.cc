#include "oaslam/map/frame.h"

#include <algorithm>
#include <ranges>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {

std::vector<ObjectDetection> IdealDetections(const Camera& camera,
                                             const std::vector<Detection>& detections) {
  std::vector<ObjectDetection> ideal;
  for (const Detection& d : detections)
    ideal.push_back({d.category_id, d.score, UndistortBox(camera, d.box),
                     TruncatedEdges(camera, d.box), SharesOf(d)});
  return ideal;
}

bool HaveKnownMotion(const std::shared_ptr<const FrameMotion>& a,
                     const std::shared_ptr<const FrameMotion>& b) {
  return a && b && a->run == b->run && !a->is_preliminary && !b->is_preliminary;
}

std::optional<Rigid3> CamFromOdom(const FrameMotion& earlier, const FrameMotion& now) {
  if (&earlier == &now) return now.cam_from_odom;
  for (const auto& [image, then] : earlier.keyframes | std::views::reverse) {
    const auto later =
        std::ranges::lower_bound(now.keyframes, image, {}, &std::pair<int, Rigid3>::first);
    if (later != now.keyframes.end() && later->first == image)
      return earlier.cam_from_odom * then.Inverse() * later->second;
  }
  return std::nullopt;
}

void TrackedFrame::ScaleLengths(double factor) {
  cam_from_world.translation *= factor;
  cam_from_reference.translation *= factor;
  covariance = WithScaledLengths(covariance, factor);
}

}  // namespace oaslam
