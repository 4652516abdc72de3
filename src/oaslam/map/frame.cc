#include "oaslam/map/frame.h"

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

}  // namespace oaslam
