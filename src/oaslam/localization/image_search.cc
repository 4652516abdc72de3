#include "oaslam/localization/image_search.h"

#include <utility>

#include "oaslam/map/camera_replacement.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {

RelocalizationResult ResultOf(const Relocalization& found) {
  RelocalizationResult result;
  result.evidence = found.evidence;
  if (found.IsFound()) {
    result.world_from_cam = found.cam_from_world.Inverse();
    result.camera = found.camera;
    if (found.camera) result.focal_sigma_px = found.focal_sigma * found.camera->fx;
  }
  result.confidence = found.confidence;
  result.object_score = found.objects.score;
  result.object_margin = found.objects.margin;
  result.inlier_points = found.points.inliers;
  result.matched_objects = static_cast<int>(found.objects.matched.size());
  result.sigma_position = found.sigma_position();
  for (const PoseHypothesis& h : found.candidates)
    result.candidates.push_back({h.cam_from_world.Inverse(), h.score});
  result.candidates_are_by = found.candidates_are_by;
  result.why_not = found.why_not;
  return result;
}

RelocalizationResult FindWithUnknownCamera(const ImageInput& input, const Camera& camera,
                                           const Map& map, RelocalizationMode mode,
                                           const SlamConfig& config, FrameMaker& maker,
                                           Relocalizer& relocalizer) {
  const Stopwatch watch;
  Camera plain = camera;
  plain.model = LensModel::kPinhole;
  plain.distortion = {};
  Frame frame = maker.Make(input, 0, config.features.count, map.classes);
  frame.camera = std::make_shared<const Camera>(plain);
  frame.features = std::make_shared<const Features>(WithCamera(*frame.features, camera, plain));
  frame.detections = IdealDetections(plain, input.detections);
  const double ms_features = watch.WallMs();
  Rng rng(static_cast<uint64_t>(config.runner.seed));
  RelocalizationResult result = ResultOf(relocalizer.FindWithUnknownCamera(frame, map, mode, rng));
  result.ms_features = ms_features;
  result.ms = watch.WallMs() - ms_features;
  return result;
}

}  // namespace oaslam
